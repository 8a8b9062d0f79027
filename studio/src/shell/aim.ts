// SPDX-License-Identifier: Apache-2.0
// Guards presses against a page that changes: a press is refused where another control was under the finger when it was aimed.

/** How long before a press it is aimed, ms; how often the places of all controls are sampled, ms; how many samples are kept. */
const AIMED_MS = 100;
const LOOK_MS = 50;
const KEPT = 6;
/** Nothing is refused for so long after the person has scrolled, changed the width or gone to another view, ms. */
const OWN_MS = 200;

const CONTROLS = "button, a[href], input, select, summary";
/** What commands nothing: a press that goes to another view than was meant is taken back by another one. */
const HARMLESS = "a[href]";
/** Views in which a press moves a machine. In the others, the editor above all, what opens under the finger is what the press before opened. */
const COMMANDING = ["devices", "panel", "verbs", "workspaces"];

/** A control, and its place in a sample. */
export interface Spot {
  control: Element;
  name: string;
  box: { left: number; top: number; right: number; bottom: number };
}

/** Returns whether a press at a point hits another control than the one that was there in the sample `before`. */
export function isAside(control: Element, name: string, x: number, y: number, before: readonly Spot[]): boolean {
  const there = before.filter(({ box }) => x >= box.left && x < box.right && y >= box.top && y < box.bottom);
  // React may have made the element anew: under the same name it is the same control to a person.
  return there.length > 0 && !there.some((one) => one.control === control || one.name === name);
}

/** Guards all presses of the page until the returned function is called. Calls `refused` for each press that it refuses. */
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
    if (!control || !before || !canCommand(control) || control.classList.contains("stop") || event.timeStamp - moved < OWN_MS) return;
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

/** Whether a press on it may move a machine: it stands in such a view, or in the bar above all views. */
function canCommand(control: Element): boolean {
  const view = control.closest<HTMLElement>("#main");
  return !control.matches(HARMLESS) && (view === null || COMMANDING.includes(view.dataset.view ?? ""));
}

function nameOf(control: Element): string {
  return `${control.tagName} ${control.getAttribute("aria-label") ?? control.textContent ?? ""}`;
}
