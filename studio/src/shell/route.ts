// SPDX-License-Identifier: Apache-2.0
// Location within the page: `#/verbs/move`, `#/scope?names=a,b`. It is kept in the address, so that it can be bookmarked and sent (unlike
// the token).
import { useSyncExternalStore } from "react";

export interface Route {
  view: string;
  /** Decoded path after the view: `["move"]` in `#/verbs/move`. */
  path: string[];
  query: URLSearchParams;
}

export function routeOf(fragment: string): Route {
  const [where = "", query = ""] = fragment.replace(/^#\/?/, "").split("?");
  const [view, ...path] = where.split("/").filter(Boolean).map(decodeURIComponent);
  return { view: view ?? "start", path, query: new URLSearchParams(query) };
}

/** Returns the address of a view, for `href`. */
export function addressOf(view: string, path: string[] = [], query: Record<string, string> = {}): string {
  const asked = new URLSearchParams(query).toString();
  return `#/${[view, ...path].map(encodeURIComponent).join("/")}${asked ? `?${asked}` : ""}`;
}

export function go(view: string, path: string[] = [], query: Record<string, string> = {}): void {
  window.location.hash = addressOf(view, path, query);
}

function watch(changed: () => void): () => void {
  window.addEventListener("hashchange", changed);
  return () => window.removeEventListener("hashchange", changed);
}

let last: { fragment: string; route: Route } | null = null;

function present(): Route {
  const fragment = window.location.hash;
  if (last?.fragment !== fragment) last = { fragment, route: routeOf(fragment) };
  return last.route;
}

export function useRoute(): Route {
  return useSyncExternalStore(watch, present);
}
