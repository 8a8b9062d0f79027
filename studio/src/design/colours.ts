// SPDX-License-Identifier: Apache-2.0
// Colours of the tokens, for what is drawn on a canvas.

/** A token such as `--series-1` as the colour that it is now: "rgb(29, 90, 168)". */
export function colour(token: string): string {
  const probe = document.createElement("span");
  probe.style.color = `var(${token})`;
  document.body.append(probe);
  const found = getComputedStyle(probe).color;
  probe.remove();
  return found;
}

/** Calls when light became dark or dark became light: draw again. The answer ends it. */
export function onThemeChange(changed: () => void): () => void {
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const switched = new MutationObserver(changed);
  switched.observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });
  dark.addEventListener("change", changed);
  return () => {
    switched.disconnect();
    dark.removeEventListener("change", changed);
  };
}
