// SPDX-License-Identifier: Apache-2.0
import uPlot from "uplot";
import { colour } from "../../design/colours";
import type { Drawn } from "./messages";
import type { Range } from "./signal/ranges";
import { timeUnit } from "./signal/ticks";

/** A scale that has an axis on the screen. */
export interface Axis {
  key: string;
  label: string;
}

/** What a person does on the screen; times in s relative to the origin of the axis. */
export interface Gestures {
  selected(from_s: number, to_s: number): void;
  zoomed(factor: number, at_s: number): void;
  moved(by_s: number): void;
  /** A press at one place. */
  clicked(at_s: number): void;
  reset(): void;
}

const AXIS_WIDTH = 62;

/** How a plot stands among others under each other: the last has the labels along x; all are as wide as the one with most axes. */
export interface Among {
  isLast: boolean;
  axes: number;
  /** What is along x cannot be looked at more closely: the values of a trace. */
  isFixed: boolean;
}

/** A plot of the screen: axes, grid and gestures by uPlot, the lines from its part of the worker's picture. */
export class Plot {
  readonly #host: HTMLElement;
  readonly #gestures: Gestures;
  #plot: uPlot | null = null;
  #built = "";
  #axes: Axis[] = [];
  #isFixed = false;
  #drawn: Drawn | null = null;
  /** Where the cursors are put. */
  over: HTMLElement | null = null;
  /** Where its part of the picture begins, from the top, in pixels of the device. */
  from = 0;
  onRebuilt: () => void = () => {};

  constructor(host: HTMLElement, gestures: Gestures) {
    this.#host = host;
    this.#gestures = gestures;
  }

  /** Axes and size; built anew where something changed. `along`: unit of the x axis where that is not time. */
  build(axes: Axis[], along: string | null, width: number, height: number, theme: number, among: Among): void {
    const asked = JSON.stringify([axes, along, width, height, theme, among]);
    if (asked === this.#built || width < 50 || height < 24) return;
    this.#built = asked;
    this.#axes = axes;
    this.#isFixed = among.isFixed;
    this.#plot?.destroy();
    this.#plot = new uPlot(this.#options(width, height, along !== null, among), this.#data(), this.#host);
    this.over = this.#plot.over;
    this.#listen(this.#plot.over);
    this.onRebuilt();
  }

  /** Pixels of the device that a picture has. */
  size(): { width: number; height: number } {
    const { width = 0, height = 0 } = this.#plot?.bbox ?? {};
    return { width: Math.round(width), height: Math.round(height) };
  }

  draw(drawn: Drawn): void {
    this.#drawn = drawn;
    this.#plot?.setData(this.#data());
  }

  destroy(): void {
    this.#plot?.destroy();
    this.#plot = null;
    this.#drawn = null;
  }

  /** Time at a place of the screen, s relative to the origin; `x` in pixels of CSS. */
  timeAt(x: number): number {
    const { lo, hi } = this.#x();
    return lo + (x / Math.max(1, this.over?.clientWidth ?? 1)) * (hi - lo);
  }

  /** Who is told of places; nobody where nothing is drawn so far: no place is a time then. */
  get #told(): Gestures | null {
    return this.#drawn ? this.#gestures : null;
  }

  /** The place of a time, as a part of the width. */
  placeOf(time_s: number): number {
    const { lo, hi } = this.#x();
    return (time_s - lo) / (hi - lo);
  }

  #x(): Range {
    const drawn = this.#drawn;
    if (drawn?.x) return drawn.x;
    if (!drawn?.span) return { lo: -1, hi: 0 };
    const { from_ns, to_ns, origin_ns } = drawn.span;
    return { lo: (from_ns - origin_ns) / 1e9, hi: (to_ns - origin_ns) / 1e9 };
  }

  #y(key: string): Range {
    return this.#drawn?.ranges[key] ?? { lo: 0, hi: 1 };
  }

  #data(): uPlot.AlignedData {
    const x = this.#x();
    return [
      [x.lo, x.hi],
      ...this.#axes.map(({ key }) => {
        const { lo, hi } = this.#y(key);
        return [lo, hi];
      }),
    ] as uPlot.AlignedData;
  }

  #options(width: number, height: number, xy: boolean, among: Among): uPlot.Options {
    const quiet = colour("--quiet");
    const line = colour("--line");
    const font = `12px ${getComputedStyle(this.#host).fontFamily}`;
    const common = { stroke: quiet, font, labelFont: font, ticks: { stroke: line, width: 1, size: 4 } };
    const grid = { stroke: line, width: 1 };
    const scales: Record<string, uPlot.Scale> = {
      x: {
        time: false,
        range: () => {
          const { lo, hi } = this.#x();
          return [lo, hi];
        },
      },
    };
    for (const { key } of this.#axes) {
      scales[key] = {
        range: () => {
          const { lo, hi } = this.#y(key);
          return [lo, hi];
        },
      };
    }
    // Others under it have the same axis.
    const above = { ticks: { show: false }, size: 0, gap: 0, values: (_: uPlot, splits: number[]) => splits.map(() => "") };
    const xAxis: uPlot.Axis = {
      ...common,
      grid,
      size: 30,
      gap: 2,
      values: (_, splits) => {
        const { lo, hi } = this.#x();
        return xy ? splits.map((at) => String(Number(at.toPrecision(6)))) : timeLabels(splits, hi - lo);
      },
    };
    const yAxes = this.#axes.map(
      ({ key, label }, i): uPlot.Axis => ({
        ...common,
        scale: key,
        label,
        labelSize: 18,
        side: i === 0 ? 3 : 1,
        size: AXIS_WIDTH - 18,
        grid: i === 0 ? grid : { show: false },
        values: (_, splits) => splits.map(figureLabel),
      }),
    );
    const [right, widest] = [Math.max(0, this.#axes.length - 1), Math.max(0, among.axes - 1)];
    return {
      width,
      height,
      padding: [8, widest === 0 ? 16 : (widest - right) * AXIS_WIDTH, among.isLast ? 0 : 8, this.#axes.length === 0 ? 16 : 0],
      legend: { show: false },
      cursor: { points: { show: false }, y: xy, drag: { x: !among.isFixed, y: false, setScale: false } },
      scales,
      axes: [among.isLast ? xAxis : { ...xAxis, ...above }, ...yAxes],
      series: [{}, ...this.#axes.map(({ key }) => ({ scale: key, paths: () => null, points: { show: false } }))],
      hooks: {
        draw: [(plot) => this.#paint(plot)],
        setSelect: [(plot) => this.#select(plot)],
      },
    };
  }

  #paint(plot: uPlot): void {
    const { width, height } = this.size();
    const [left, top] = [Math.round(plot.bbox.left), Math.round(plot.bbox.top)];
    if (this.#drawn) plot.ctx.drawImage(this.#drawn.bitmap, 0, this.from, width, height, left, top, width, height);
  }

  #select(plot: uPlot): void {
    const { left, width } = plot.select;
    if (width < 4) return;
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    this.#told?.selected(this.timeAt(left), this.timeAt(left + width));
  }

  #listen(over: HTMLElement): void {
    over.addEventListener(
      "wheel",
      (event) => {
        if (this.#isFixed) return;
        event.preventDefault();
        const width = Math.max(1, over.clientWidth);
        const { lo, hi } = this.#x();
        if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
          this.#told?.moved(((event.deltaX || event.deltaY) / width) * (hi - lo));
        } else {
          this.#told?.zoomed(event.deltaY > 0 ? 1.25 : 0.8, this.timeAt(event.offsetX));
        }
      },
      { passive: false },
    );
    let pressed = 0;
    over.addEventListener("mousedown", (event) => {
      pressed = event.clientX;
    });
    over.addEventListener("click", (event) => {
      if (!this.#isFixed && Math.abs(event.clientX - pressed) < 4) this.#told?.clicked(this.timeAt(event.offsetX));
    });
    over.addEventListener("dblclick", () => this.#gestures.reset());
    // With the shift key, or the middle button, a drag moves the times instead of choosing some.
    over.addEventListener(
      "pointerdown",
      (event) => {
        if (!(event.shiftKey || event.button === 1)) return;
        event.preventDefault();
        event.stopImmediatePropagation();
        over.setPointerCapture(event.pointerId);
        let last = event.clientX;
        const move = (now: PointerEvent) => {
          const { lo, hi } = this.#x();
          this.#told?.moved(((last - now.clientX) / Math.max(1, over.clientWidth)) * (hi - lo));
          last = now.clientX;
        };
        over.addEventListener("pointermove", move);
        over.addEventListener("pointerup", () => over.removeEventListener("pointermove", move), { once: true });
      },
      { capture: true },
    );
    over.addEventListener("mousedown", (event) => event.shiftKey && event.stopImmediatePropagation(), { capture: true });
  }
}

function timeLabels(splits: number[], span_s: number): string[] {
  const { per_s } = timeUnit(span_s);
  return splits.map((at) => String(Number((at * per_s).toPrecision(8))));
}

function figureLabel(value: number): string {
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-3)) return value.toExponential(1);
  return String(Number(value.toPrecision(5)));
}
