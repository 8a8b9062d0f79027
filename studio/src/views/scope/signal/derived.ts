// SPDX-License-Identifier: Apache-2.0
// Traces computed from others. They have gaps where the others have gaps.
import type { Piece, Series } from "./series";

/** Computes the derivative in units per second, between each value and the previous one, at the time of the later one. */
export function derivative(of: Series): Series {
  const made: Series = [];
  let time_ns = Number.NaN;
  let value = Number.NaN;
  for (const piece of of) {
    const times: number[] = [];
    const values: number[] = [];
    if (piece.broken) time_ns = Number.NaN;
    for (let i = piece.from; i < piece.to; i += 1) {
      const now_ns = piece.times_ns[i] as number;
      const now = piece.values[i] as number;
      if (now_ns > time_ns) {
        times.push(now_ns);
        values.push(((now - value) * 1e9) / (now_ns - time_ns));
      }
      time_ns = now_ns;
      value = now;
    }
    made.push(pieceOf(times, values, piece.broken));
  }
  return made.filter((piece) => piece.to > 0);
}

/**
 * Subtracts one series from another, at the times of the first, using the current value of the second. The result is undefined in gaps
 * of either series.
 */
export function difference(one: Series, other: Series): Series {
  return combined([one, other], ([first, second]) => (first as number) - (second as number));
}

/**
 * Computes values from several series, at the times of the first, using the current values of the others. The result is undefined in
 * gaps of any series.
 */
export function combined(of: readonly Series[], value: (of: readonly number[]) => number): Series {
  const [one = [], ...others] = of;
  const held = others.map((other) => new HeldValue(other));
  const values_then: number[] = Array.from({ length: of.length }, () => Number.NaN);
  const made: Series = [];
  for (const piece of one) {
    let times: number[] = [];
    let values: number[] = [];
    let broken = piece.broken;
    for (let i = piece.from; i < piece.to; i += 1) {
      const time_ns = piece.times_ns[i] as number;
      let isKnown = true;
      held.forEach((other, at) => {
        const then = other.at(time_ns);
        if (then === null) isKnown = false;
        else values_then[at + 1] = then;
      });
      if (!isKnown) {
        if (times.length > 0) made.push(pieceOf(times, values, broken));
        times = [];
        values = [];
        broken = true;
        continue;
      }
      times.push(time_ns);
      values_then[0] = piece.values[i] as number;
      values.push(value(values_then));
    }
    if (times.length > 0) made.push(pieceOf(times, values, broken));
  }
  return made;
}

function pieceOf(times: number[], values: number[], broken: boolean): Piece {
  return { times_ns: Float64Array.from(times), values: Float64Array.from(values), from: 0, to: times.length, broken };
}

// Returns the value of a series at ascending times.
class HeldValue {
  readonly #series: Series;
  #piece = 0;
  #next: number;
  #value: number | null = null;

  constructor(series: Series) {
    this.#series = series;
    this.#next = series[0]?.from ?? 0;
  }

  at(time_ns: number): number | null {
    for (let piece = this.#series[this.#piece]; piece; piece = this.#series[this.#piece]) {
      while (this.#next < piece.to && (piece.times_ns[this.#next] as number) <= time_ns) {
        this.#value = piece.values[this.#next] as number;
        this.#next += 1;
      }
      if (this.#next < piece.to) return this.#value;
      const following = this.#series[this.#piece + 1];
      if (!following) return this.#value;
      if ((following.times_ns[following.from] as number) > time_ns) return following.broken ? this.#betweenOf(piece, time_ns) : this.#value;
      this.#piece += 1;
      this.#next = following.from;
    }
    return this.#value;
  }

  #betweenOf(piece: Piece, time_ns: number): number | null {
    return (piece.times_ns[piece.to - 1] as number) === time_ns ? this.#value : null;
  }
}
