// SPDX-License-Identifier: Apache-2.0
// A press is meant for what was under the finger when it was aimed. Where another control has come there since, the press is refused.

/** For how long a control has to be where it is pressed, ms, and how often it is looked where all of them are. */
const AIMED_MS = 100;
const LOOK_MS = 50;
const KEPT = 6;
/** For how long after one's own scrolling, a new width or another view nothing is refused, ms: then one has moved it oneself. */
const OWN_MS = 200;

const CONTROLS = "button, a[href], input, select, summary";

/** A control, where it was. */
export interface Spot {
  control: Element;
  name: string;
  box: { left: number; top: number; right: number; bottom: number };
}

/** Whether a press at a point hits another control than the one that was aimed at. `before`: all controls, as they were then. */
export function isAside(control: Element, name: string, x: number, y: number, before: readonly Spot[]): boolean {
  const there = before.filter(({ box }) => x >= box.left && x < box.right && y >= box.top && y < box.bottom);
  // A control that is drawn anew is the same to whoever looks at it.
  return there.length > 0 && !there.some((one) => one.control === control || one.name === name);
}

/** Watches all presses of the page, until the answer is called. `refused`: is told of each that was refused. */
export function watchAim(refused: () => void): () => void {
  const samples: { time: number; spots: Spot[] }[] = [];
  let moved = Number.NEGATIVE_INFINITY;
  let isRefusing = false;
  const look = () => {
    if (document.hidden) return;
    const spots = [...document.querySelectorAll(CONTROLS)].map((control) => ({
      control,
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
    // The emergency stop never moves, and nothing is ever put over it.
    if (!control || !before || control.classList.contains("stop") || event.timeStamp - moved < OWN_MS) return;
    isRefusing = isAside(control, nameOf(control), event.clientX, event.clientY, before.spots);
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
