// SPDX-License-Identifier: Apache-2.0
import type { Show, ShownTrace } from "../messages";
import type { Range, Ranges } from "../signal/ranges";
import type { Series } from "../signal/series";
import type { Span } from "../signal/sweep";
import type { Canvas } from "./draw";
import { type Scales, scaleKey } from "./scales";
import { type Store, traceSeries } from "./traces";

interface Curve {
  trace: ShownTrace;
  x: Float64Array;
  y: Float64Array;
  breaks: Set<number>;
}

/** Draws the traces against one of them instead of time. Points are drawn at the times of the trace along y. */
export function drawXy(canvas: Canvas, show: Show, of: Store, span: Span, ranges: Ranges): Scales {
  const along = show.traces.find((trace) => trace.id === show.xy);
  if (!along) return { ranges: {}, x: null };
  const base = traceSeries(of, along.setup, span.from_ns, span.to_ns);
  const curves = show.traces
    .filter((trace) => trace !== along && !trace.setup.hidden)
    .map((trace) => curve(trace, base, traceSeries(of, trace.setup, span.from_ns, span.to_ns)));
  const [low, high] = bounds(curves.map(({ x }) => x));
  const x = along.setup.range ? { lo: along.setup.range[0], hi: along.setup.range[1] } : ranges.of(`x ${along.id}`, low, high);
  const made: Record<string, Range> = {};
  for (const one of curves) {
    const key = scaleKey(one.trace, show);
    const fixed = one.trace.setup.range;
    const [lo, hi] = bounds(curves.filter((other) => scaleKey(other.trace, show) === key).map(({ y }) => y));
    made[key] ??= fixed ? { lo: fixed[0], hi: fixed[1] } : ranges.of(key, lo, hi);
  }
  for (const one of curves) stroke(canvas, one, x, made[scaleKey(one.trace, show)] as Range, show);
  return { ranges: made, x };
}

function curve(trace: ShownTrace, along: Series, series: Series): Curve {
  const x: number[] = [];
  const y: number[] = [];
  const breaks = new Set<number>();
  const times: number[] = [];
  const values: number[] = [];
  const holes = new Set<number>();
  for (const piece of along) {
    if (piece.broken) holes.add(times.length);
    for (let i = piece.from; i < piece.to; i += 1) {
      times.push(piece.times_ns[i] as number);
      values.push(piece.values[i] as number);
    }
  }
  let at = -1;
  for (const piece of series) {
    if (piece.broken) breaks.add(x.length);
    for (let i = piece.from; i < piece.to; i += 1) {
      const time_ns = piece.times_ns[i] as number;
      while (at + 1 < times.length && (times[at + 1] as number) <= time_ns) {
        at += 1;
        if (holes.has(at)) breaks.add(x.length);
      }
      if (at < 0) continue;
      x.push(values[at] as number);
      y.push(piece.values[i] as number);
    }
  }
  return { trace, x: Float64Array.from(x), y: Float64Array.from(y), breaks };
}

function bounds(of: Float64Array[]): [number, number] {
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  for (const values of of) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return [low, high];
}

function stroke(canvas: Canvas, { trace, x, y, breaks }: Curve, along: Range, on: Range, show: Show): void {
  canvas.save();
  canvas.strokeStyle = trace.colour;
  canvas.lineWidth = 1.5 * show.ratio;
  canvas.setLineDash(trace.pattern.map((dash) => dash * show.ratio));
  canvas.beginPath();
  let pen = false;
  let lastX = Number.NaN;
  let lastY = Number.NaN;
  for (let i = 0; i < x.length; i += 1) {
    const px = (((x[i] as number) - along.lo) / (along.hi - along.lo)) * show.width;
    const py = show.height - (((y[i] as number) - on.lo) / (on.hi - on.lo)) * show.height;
    if (px - px !== 0 || py - py !== 0) {
      pen = false;
      continue;
    }
    const same = Math.abs(px - lastX) < 0.5 && Math.abs(py - lastY) < 0.5;
    if (pen && same && !breaks.has(i)) continue;
    if (pen && !breaks.has(i)) canvas.lineTo(px, py);
    else canvas.moveTo(px, py);
    pen = true;
    lastX = px;
    lastY = py;
  }
  canvas.stroke();
  if (!Number.isNaN(lastX)) {
    canvas.fillStyle = trace.colour;
    canvas.beginPath();
    canvas.arc(lastX, lastY, 4 * show.ratio, 0, 2 * Math.PI);
    canvas.fill();
  }
  canvas.restore();
}
