// SPDX-License-Identifier: Apache-2.0
import type { Series } from "./series";

/** Points of a line: `x` in pixels from the left edge, `y` in the trace's unit; a NaN `y` breaks the line. */
export interface Points {
  x: Float32Array;
  y: Float64Array;
  count: number;
  /** Number of values that the points represent. */
  values: number;
}

/**
 * Returns the points of a trace on a screen that is `width` pixels wide and shows `from_ns … to_ns`.
 *
 * If several values fall in one pixel column, the first, minimum, maximum and last of them are drawn in time order: pixel by pixel, the
 * line equals the line through all values, and no peak is lost. If there are few values, each keeps its exact position.
 */
export function decimate(series: Series, from_ns: number, to_ns: number, width: number): Points {
  const per_ns = width / (to_ns - from_ns);
  const all = series.reduce((sum, piece) => sum + piece.to - piece.from, 0);
  const line = new Line(Math.min(all + series.length, 5 * (width + 4) + 2 * series.length) + 8);
  if (all <= 2 * width) each(series, from_ns, per_ns, line);
  else columns(series, from_ns, per_ns, line);
  return { ...line.points(), values: all };
}

function each(series: Series, from_ns: number, per_ns: number, line: Line): void {
  for (const piece of series) {
    if (piece.broken) line.lift();
    for (let i = piece.from; i < piece.to; i += 1) line.add(((piece.times_ns[i] as number) - from_ns) * per_ns, piece.values[i] as number);
  }
}

function columns(series: Series, from_ns: number, per_ns: number, line: Line): void {
  let column = Number.NaN;
  let first = 0;
  let low = 0;
  let high = 0;
  let last = 0;
  let lowFirst = true;
  const flush = () => {
    if (Number.isNaN(column)) return;
    const x = column + 0.5;
    line.add(x, first);
    const [one, other] = lowFirst ? [low, high] : [high, low];
    if (one !== first) line.add(x, one);
    if (other !== one) line.add(x, other);
    if (last !== other) line.add(x, last);
    column = Number.NaN;
  };
  for (const { times_ns, values, from, to, broken } of series) {
    if (broken) {
      flush();
      line.lift();
    }
    for (let i = from; i < to; i += 1) {
      const value = values[i] as number;
      if (value - value !== 0) {
        flush();
        line.lift();
        continue;
      }
      const at = Math.floor(((times_ns[i] as number) - from_ns) * per_ns);
      if (at !== column) {
        flush();
        column = at;
        first = value;
        low = value;
        high = value;
      } else if (value < low) {
        low = value;
        lowFirst = false;
      } else if (value > high) {
        high = value;
        lowFirst = true;
      }
      last = value;
    }
  }
  flush();
}

class Line {
  #x: Float32Array;
  #y: Float64Array;
  #count = 0;

  constructor(room: number) {
    this.#x = new Float32Array(room);
    this.#y = new Float64Array(room);
  }

  add(x: number, y: number): void {
    if (this.#count === this.#x.length) this.#grow();
    this.#x[this.#count] = x;
    this.#y[this.#count] = y;
    this.#count += 1;
  }

  lift(): void {
    if (this.#count > 0 && !Number.isNaN(this.#y[this.#count - 1] as number)) this.add(this.#x[this.#count - 1] as number, Number.NaN);
  }

  points(): { x: Float32Array; y: Float64Array; count: number } {
    return { x: this.#x, y: this.#y, count: this.#count };
  }

  #grow(): void {
    const x = new Float32Array(2 * this.#x.length);
    const y = new Float64Array(2 * this.#y.length);
    x.set(this.#x);
    y.set(this.#y);
    this.#x = x;
    this.#y = y;
  }
}
