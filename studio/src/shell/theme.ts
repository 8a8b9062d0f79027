// SPDX-License-Identifier: Apache-2.0
import { WatchedValue } from "../control/watched";

/** Theme, set by the operating system or by the switch. */
export type Theme = "system" | "light" | "dark";

const KEY = "opengpac.theme";

export const theme = new WatchedValue<Theme>(kept());

function kept(): Theme {
  const said = localStorage.getItem(KEY);
  return said === "light" || said === "dark" ? said : "system";
}

export function applyTheme(): void {
  const now = theme.get();
  if (now === "system") {
    delete document.documentElement.dataset.theme;
    localStorage.removeItem(KEY);
  } else {
    document.documentElement.dataset.theme = now;
    localStorage.setItem(KEY, now);
  }
}

export function setTheme(next: Theme): void {
  theme.set(next);
  applyTheme();
}
