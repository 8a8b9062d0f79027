// SPDX-License-Identifier: Apache-2.0
import { WatchedValue } from "../control/watched";

/**
 * Theme, set by the operating system or by the switch. The high-contrast theme is light or dark depending on the operating system's
 * setting.
 */
export type Theme = "system" | "light" | "dark" | "contrast";

const THEMES: readonly string[] = ["light", "dark", "contrast"] satisfies Theme[];
const KEY = "opengpac.theme";
/** Media query that matches if the operating system requests high contrast or replaces the colours of pages. */
const MORE = "(prefers-contrast: more), (forced-colors: active)";

export const theme = new WatchedValue<Theme>(kept());

function kept(): Theme {
  const said = localStorage.getItem(KEY) ?? "";
  return THEMES.includes(said) ? (said as Theme) : "system";
}

/** Shows the page in its theme, and follows changes to the operating system's settings. */
export function applyTheme(): void {
  window.matchMedia(MORE).addEventListener("change", show);
  show();
}

export function setTheme(next: Theme): void {
  theme.set(next);
  if (next === "system") localStorage.removeItem(KEY);
  else localStorage.setItem(KEY, next);
  show();
}

function show(): void {
  const now = theme.get();
  const { dataset } = document.documentElement;
  if (now === "system") delete dataset.theme;
  else dataset.theme = now;
  const isMore = now === "contrast" || (now === "system" && window.matchMedia(MORE).matches);
  if (isMore) dataset.contrast = "more";
  else delete dataset.contrast;
}
