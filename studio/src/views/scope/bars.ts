// SPDX-License-Identifier: Apache-2.0
import type { WatchedValue } from "../../control/watched";
import { duration } from "../../design/numbers";
import type { Plot } from "./plot";

const NAMES = ["A", "B"] as const;

/** The two time cursors on the screen, which a person drags or moves with the arrow keys (ten times as far with Shift). */
export class Bars {
  readonly #plot: Plot;
  readonly #cursors: WatchedValue<[number, number] | null>;
  readonly #bars: HTMLElement[];
  /** Returns the position of the recording's cursor, s relative to the origin; null if the views follow the running system. */
  readonly #present: () => number | null;
  readonly #stand = document.createElement("div");
  /** Returns the time of a replay's first difference, s relative to the origin; null if there is none. */
  readonly #differs: () => number | null;
  readonly #mark = document.createElement("div");

  constructor(
    plot: Plot,
    cursors: WatchedValue<[number, number] | null>,
    present: () => number | null = () => null,
    differs: () => number | null = () => null,
  ) {
    this.#plot = plot;
    this.#cursors = cursors;
    this.#present = present;
    this.#stand.className = "time-stand";
    this.#stand.hidden = true;
    this.#differs = differs;
    this.#mark.className = "difference-mark";
    this.#mark.hidden = true;
    this.#bars = NAMES.map((name, i) => this.#made(name, i as 0 | 1));
  }

  /** Attaches the cursors to the plot after the plot has been rebuilt. */
  attach(): void {
    this.#plot.over?.append(this.#stand, this.#mark, ...this.#bars);
    this.place();
  }

  place(): void {
    this.#stood(this.#stand, this.#present());
    this.#stood(this.#mark, this.#differs());
    const at = this.#cursors.get();
    this.#bars.forEach((bar, i) => {
      bar.hidden = at === null;
      if (!at) return;
      const time_s = at[i] as number;
      const place = this.#plot.placeOf(time_s);
      bar.style.left = `${(Math.min(1, Math.max(0, place)) * 100).toFixed(3)}%`;
      bar.classList.toggle("outside", place < 0 || place > 1);
      bar.setAttribute("aria-valuenow", time_s.toFixed(6));
      bar.setAttribute("aria-valuetext", duration(time_s * 1e9));
    });
  }

  // Moved by a transform, without layout: the cursor of a recording moves while the screen behind it stays painted.
  #stood(line: HTMLElement, time_s: number | null): void {
    const place = time_s === null ? -1 : this.#plot.placeOf(time_s);
    line.hidden = place < 0 || place > 1;
    line.style.transform = `translateX(${(place * (this.#plot.over?.clientWidth ?? 0)).toFixed(1)}px)`;
  }

  remove(): void {
    for (const bar of [this.#stand, this.#mark, ...this.#bars]) bar.remove();
  }

  #made(name: string, i: 0 | 1): HTMLElement {
    const bar = document.createElement("div");
    bar.className = `time-cursor cursor-${name.toLowerCase()}`;
    bar.tabIndex = 0;
    bar.setAttribute("role", "slider");
    bar.setAttribute("aria-label", `Cursor ${name}`);
    bar.setAttribute("aria-orientation", "horizontal");
    bar.innerHTML = `<span class="letter" aria-hidden="true">${name}</span>`;
    bar.addEventListener("mousedown", (event) => event.stopPropagation());
    bar.addEventListener("pointerdown", (event) => {
      event.stopPropagation();
      event.preventDefault();
      bar.focus();
      bar.setPointerCapture(event.pointerId);
      const move = (now: PointerEvent) => {
        const left = this.#plot.over?.getBoundingClientRect().left ?? 0;
        this.#set(i, this.#plot.timeAt(now.clientX - left));
      };
      bar.addEventListener("pointermove", move);
      bar.addEventListener("pointerup", () => bar.removeEventListener("pointermove", move), { once: true });
    });
    bar.addEventListener("keydown", (event) => {
      const steps = event.key === "ArrowLeft" ? -1 : event.key === "ArrowRight" ? 1 : 0;
      if (steps === 0) return;
      event.preventDefault();
      event.stopPropagation();
      const width = this.#plot.over?.clientWidth ?? 1;
      const pixel = this.#plot.timeAt(width) - this.#plot.timeAt(0);
      const at = this.#cursors.get();
      if (at) this.#set(i, at[i] + ((event.shiftKey ? 10 : 1) * steps * pixel) / width);
    });
    return bar;
  }

  #set(i: 0 | 1, time_s: number): void {
    const at = this.#cursors.get();
    if (!at) return;
    this.#cursors.set(i === 0 ? [time_s, at[1]] : [at[0], time_s]);
    this.place();
  }
}
