// SPDX-License-Identifier: Apache-2.0
const KEY = "opengpac.token";

/** Removes the token from the address (`#token=…`), stores it for this tab, and leaves the rest of the fragment as the route. */
export function takeToken(): string | null {
  const found = tokenIn(window.location.hash);
  if (found) {
    sessionStorage.setItem(KEY, found.token);
    history.replaceState(null, "", `${window.location.pathname}${window.location.search}${found.rest}`);
  }
  return sessionStorage.getItem(KEY);
}

export function keepToken(token: string): void {
  sessionStorage.setItem(KEY, token);
}

export function forgetToken(): void {
  sessionStorage.removeItem(KEY);
}

/** Returns the token in a fragment such as `#token=abc` or `#/scope&token=abc`, and the fragment without it. */
export function tokenIn(fragment: string): { token: string; rest: string } | null {
  const parts = fragment.replace(/^#/, "").split("&");
  const token = parts.find((part) => part.startsWith("token="))?.slice("token=".length);
  if (!token) return null;
  const rest = parts.filter((part) => !part.startsWith("token=")).join("&");
  return { token: decodeURIComponent(token), rest: rest ? `#${rest}` : "" };
}
