// SPDX-License-Identifier: Apache-2.0
// Colours of the tokens, for drawing on a canvas.

/** Returns the current colour of a token such as `--series-1`: "rgb(29, 90, 168)". */
export function colour(token: string): string {
  const probe = document.createElement("span");
  probe.style.color = `var(${token})`;
  document.body.append(probe);
  const found = getComputedStyle(probe).color;
  probe.remove();
  return found;
}

/** Calls `changed` when the theme switches between light, dark and high contrast, until the returned function is called. */
export function onThemeChange(changed: () => void): () => void {
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const switched = new MutationObserver(changed);
  switched.observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme", "data-contrast"] });
  dark.addEventListener("change", changed);
  return () => {
    switched.disconnect();
    dark.removeEventListener("change", changed);
  };
}
