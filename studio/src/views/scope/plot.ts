// SPDX-License-Identifier: Apache-2.0
import uPlot from "uplot";
import { colour } from "../../design/colours";
import type { DrawnTrace } from "./messages";
import { type Labels, labelsOf } from "./signal/labels";
import type { Range } from "./signal/ranges";
import { multiples, stepOf, timeUnit } from "./signal/ticks";

/** A scale with an axis on the screen. */
export interface Axis {
  key: string;
  label: string;
}

/** Handlers of gestures on the screen; times are in s relative to the origin of the axis. */
export interface Gestures {
  selected(from_s: number, to_s: number): void;
  zoomed(factor: number, at_s: number): void;
  moved(by_s: number): void;
  /** Called for a click, that is, a press without movement. */
  clicked(at_s: number): void;
  reset(): void;
}

const AXIS_WIDTH = 62;
/** Maximum length of a label, in characters, and minimum distance between labels, px; along x and along y. */
const ALONG = { room: 8, space_px: 70 };
const UP = { room: 6, space_px: 34 };

/** Position of a plot in a column of plots: only the last plot has labels along x, and all are as wide as the plot with the most axes. */
export interface Among {
  isLast: boolean;
  axes: number;
  /** True if the x axis cannot be zoomed because it shows the values of a trace. */
  isFixed: boolean;
}

/** A plot of the screen: uPlot draws axes and grid and handles gestures; the lines are part of the worker's picture. */
export class Plot {
  readonly #host: HTMLElement;
  readonly #gestures: Gestures;
  #plot: uPlot | null = null;
  #built = "";
  #axes: Axis[] = [];
  #isFixed = false;
  /** True if the labels along x are drawn at a plot below this one. */
  #isAbove = false;
  #drawn: DrawnTrace | null = null;
  /** Element to which the cursors are attached; null before the plot is built. */
  over: HTMLElement | null = null;
  /** Offset of the plot from the top of the picture, in device pixels. */
  from = 0;
  onRebuilt: () => void = () => {};

  constructor(host: HTMLElement, gestures: Gestures) {
    this.#host = host;
    this.#gestures = gestures;
  }

  /** Sets axes and size, and rebuilds the plot if they have changed. `along` is the unit of the x axis; null for time. */
  build(axes: Axis[], along: string | null, width: number, height: number, theme: number, among: Among): void {
    const asked = JSON.stringify([axes, along, width, height, theme, among]);
    if (asked === this.#built || width < 50 || height < 24) return;
    this.#built = asked;
    this.#axes = axes;
    this.#isFixed = among.isFixed;
    this.#isAbove = !among.isLast;
    this.#plot?.destroy();
    // All scales of uPlot run from 0 to 1, and the marks are computed here, because uPlot's own fail for large offsets.
    const data = [[0, 1], ...axes.map(() => [0, 1])] as uPlot.AlignedData;
    this.#common.clear();
    this.#plot = new uPlot(this.#options(width, height, along !== null, among), data, this.#host);
    this.over = this.#plot.over;
    this.#listen(this.#plot.over);
    this.onRebuilt();
  }

  /** Returns the size of the picture in device pixels. */
  size(): { width: number; height: number } {
    const { width = 0, height = 0 } = this.#plot?.bbox ?? {};
    return { width: Math.round(width), height: Math.round(height) };
  }

  draw(drawn: DrawnTrace): void {
    this.#drawn = drawn;
    this.#plot?.redraw(false, true);
  }

  destroy(): void {
    this.#plot?.destroy();
    this.#plot = null;
    this.#drawn = null;
  }

  /** Returns the time at a position on the screen, s relative to the origin; `x` is in CSS pixels. */
  timeAt(x: number): number {
    const { lo, hi } = this.#x();
    return lo + (x / Math.max(1, this.over?.clientWidth ?? 1)) * (hi - lo);
  }

  /** Returns the receiver of gestures; null before the first picture, because positions do not correspond to times until then. */
  get #told(): Gestures | null {
    return this.#drawn ? this.#gestures : null;
  }

  /** Returns the position of a time as a fraction of the width. */
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

  /** Returns the positions of an axis's tick marks, as fractions of its range, and their labels. */
  #marks({ lo, hi }: Range, length_px: number, { room, space_px }: typeof UP, per = 1): { places: number[]; labels: Labels } {
    const step = stepOf(lo, hi, Math.max(1, Math.floor(length_px / space_px)));
    if (Number.isNaN(step)) return { places: [], labels: labelsOf([], 1, room) };
    const marks = multiples(lo, hi, step);
    const scaled = per === 1 ? marks : marks.map((mark) => mark * per);
    return { places: marks.map((mark) => Math.min(1, Math.max(0, (mark - lo) / (hi - lo)))), labels: labelsOf(scaled, step * per, room) };
  }

  /** Common factor or offset of all labels of an axis, by the axis's index; displayed next to the axis. */
  readonly #common = new Map<number, string>();

  #options(width: number, height: number, xy: boolean, among: Among): uPlot.Options {
    const quiet = colour("--quiet");
    const line = colour("--line");
    const font = `12px ${getComputedStyle(this.#host).fontFamily}`;
    const common = { stroke: quiet, font, labelFont: font, ticks: { stroke: line, width: 1, size: 4 } };
    const grid = { stroke: line, width: 1 };
    const scales: Record<string, uPlot.Scale> = Object.fromEntries(
      ["x", ...this.#axes.map(({ key }) => key)].map((key) => [key, { time: false, range: [0, 1] as uPlot.Range.MinMax }]),
    );
    const marksAt = (axis: number) => {
      const key = this.#axes[axis - 1]?.key;
      if (key !== undefined) return this.#marks(this.#y(key), height - (among.isLast ? 46 : 16), UP);
      const range = this.#x();
      const length_px = width - AXIS_WIDTH * Math.max(1, among.axes);
      return this.#marks(range, length_px, ALONG, xy ? 1 : timeUnit(range.hi - range.lo).per_s);
    };
    const marked: Pick<uPlot.Axis, "splits" | "values"> = {
      splits: (_, axis) => marksAt(axis).places,
      values: (_, _places, axis) => {
        const { texts, common } = marksAt(axis).labels;
        this.#common.set(axis, common);
        return texts;
      },
    };
    // The plots below have the same axis.
    const above = { ticks: { show: false }, size: 0, gap: 0, values: (_: uPlot, splits: number[]) => splits.map(() => "") };
    const xAxis: uPlot.Axis = {
      ...common,
      grid,
      ...marked,
      size: 30,
      gap: 2,
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
        ...marked,
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
    for (const [axis, text] of this.#common) if (text !== "") this.#writeCommon(plot, axis, text);
  }

  /** Writes the common factor or offset of the labels at the end of their axis, inside the plot. */
  #writeCommon(plot: uPlot, axis: number, text: string): void {
    const { ctx, bbox } = plot;
    const ratio = uPlot.pxRatio;
    const isAlong = axis === 0;
    if (isAlong && this.#isAbove) return;
    ctx.save();
    ctx.font = `${12 * ratio}px ${getComputedStyle(this.#host).fontFamily}`;
    ctx.textBaseline = "middle";
    ctx.textAlign = axis === 1 ? "left" : "right";
    const [size, gap, tall] = [ctx.measureText(text).width, 4 * ratio, 16 * ratio];
    const x = axis === 1 ? bbox.left + gap : bbox.left + bbox.width - gap;
    const y = isAlong ? bbox.top + bbox.height - tall / 2 - gap : bbox.top + gap + tall * (Math.max(1, axis - 1) - 0.5);
    ctx.fillStyle = colour("--panel");
    ctx.fillRect(axis === 1 ? x - gap / 2 : x - size - gap / 2, y - tall / 2, size + gap, tall);
    ctx.fillStyle = colour("--text");
    ctx.fillText(text, x, y);
    ctx.restore();
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
    // Dragging with Shift or the middle button scrolls in time instead of selecting a span.
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
