// SPDX-License-Identifier: Apache-2.0
// Guards presses against a changing page: a press of a commanding control is refused if a different control was under the finger when it
// was aimed. The emergency stop is not guarded: it never moves, and nothing ever covers it.

/**
 * First the time before a press during which a person aims, ms; then the sampling period of the positions of all controls, ms; and then
 * the number of samples kept.
 */
const AIMED_MS = 100;
const LOOK_MS = 50;
const KEPT = 6;
/** Time after a person scrolls, resizes the window or switches views, during which no press is refused, ms. */
const OWN_MS = 200;

const CONTROLS = "button, a[href], input, select, summary";
/** Selector of elements whose controls command the system. A press of any other control can be undone. */
const COMMANDING = "[data-commands]";

/** Name of a control, and its position in a sample. */
export interface Spot {
  name: string;
  box: { left: number; top: number; right: number; bottom: number };
}

/** Returns whether a press at a point hits a control other than the one that was at this point in the sample `before`. */
export function isAside(name: string, x: number, y: number, before: readonly Spot[]): boolean {
  const there = before.filter(({ box }) => x >= box.left && x < box.right && y >= box.top && y < box.bottom);
  // To a person a control is what its name says: React recreates elements, and gives an element to the next alarm of a list.
  return there.length > 0 && !there.some((one) => one.name === name);
}

/**
 * Guards all commanding controls against misdirected presses until the returned function is called. Calls `refused` for each press that
 * it refuses.
 */
export function watchAim(refused: () => void): () => void {
  const samples: { time: number; spots: Spot[] }[] = [];
  let moved = Number.NEGATIVE_INFINITY;
  let isRefusing = false;
  const look = () => {
    if (document.hidden) return;
    const spots = [...document.querySelectorAll(CONTROLS)].map((control) => ({
      name: nameOf(control),
      box: control.getBoundingClientRect(),
    }));
    samples.push({ time: performance.now(), spots });
    if (samples.length > KEPT) samples.shift();
  };
  const move = () => {
    moved = performance.now();
  };
  const press = (event: PointerEvent) => {
    isRefusing = false;
    const control = event.target instanceof Element ? event.target.closest(CONTROLS) : null;
    const before = samples.findLast((one) => one.time <= event.timeStamp - AIMED_MS);
    if (!control?.closest(COMMANDING) || !before || event.timeStamp - moved < OWN_MS) return;
    isRefusing = isAside(nameOf(control), event.clientX, event.clientY, before.spots);
    if (isRefusing) refused();
    swallow(event);
  };
  const swallow = (event: Event) => {
    if (!isRefusing || (event instanceof MouseEvent && event.type === "click" && event.detail === 0)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  };
  const looking = setInterval(look, LOOK_MS);
  const rest = ["pointerup", "mousedown", "mouseup", "touchstart", "touchend", "click"];
  window.addEventListener("pointerdown", press, true);
  for (const name of rest) window.addEventListener(name, swallow, { capture: true, passive: false });
  for (const name of ["scroll", "resize", "hashchange"]) window.addEventListener(name, move, true);
  return () => {
    clearInterval(looking);
    window.removeEventListener("pointerdown", press, true);
    for (const name of rest) window.removeEventListener(name, swallow, true);
    for (const name of ["scroll", "resize", "hashchange"]) window.removeEventListener(name, move, true);
  };
}

function nameOf(control: Element): string {
  return `${control.tagName} ${control.getAttribute("aria-label") ?? control.textContent ?? ""}`;
}
