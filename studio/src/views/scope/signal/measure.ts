// SPDX-License-Identifier: Apache-2.0
import type { RecordedSums as Sums } from "../../../control/shapes";
import type { Series } from "./series";

/** Measurements of a trace over a span. Every finite value counts once. */
export interface Measures {
  count: number;
  min: number;
  max: number;
  mean: number;
  rms: number;
  /** Population standard deviation: root mean square of the differences from the mean. */
  deviation: number;
  peak_to_peak: number;
}

/** Measures a series between two times; returns null if there is no value. */
export function measure(series: Series, from_ns = Number.NEGATIVE_INFINITY, to_ns = Number.POSITIVE_INFINITY): Measures | null {
  let count = 0;
  let min = Number.POSITIVE_INFINITY;
  let max = Number.NEGATIVE_INFINITY;
  let sum = 0;
  let squares = 0;
  for (const { times_ns, values, from, to } of series) {
    for (let i = from; i < to; i += 1) {
      const value = values[i] as number;
      const time_ns = times_ns[i] as number;
      if (value - value !== 0 || time_ns < from_ns || time_ns > to_ns) continue;
      count += 1;
      if (value < min) min = value;
      if (value > max) max = value;
      sum += value;
      squares += value * value;
    }
  }
  if (count === 0) return null;
  // A second pass around the mean: for large values with small differences, no one-pass formula is accurate enough.
  const mean = sum / count;
  let spread = 0;
  for (const { times_ns, values, from, to } of series) {
    for (let i = from; i < to; i += 1) {
      const apart = (values[i] as number) - mean;
      const time_ns = times_ns[i] as number;
      if (apart - apart === 0 && time_ns >= from_ns && time_ns <= to_ns) spread += apart * apart;
    }
  }
  return measuresOf({ count, min, max, sum, squares, spread });
}

/** Computes the measurements from exact sums of all values. */
export function measuresOf({ count, min, max, sum, squares, spread }: Sums): Measures | null {
  if (count === 0) return null;
  const [mean, rms, deviation] = [sum / count, Math.sqrt(squares / count), Math.sqrt(spread / count)];
  return { count, min, max, mean, rms, deviation, peak_to_peak: max - min };
}

/** Returns the spread of the union of two sections, from both spreads and the difference of their means. */
export function spreadOf(one: Sums, other: Sums): number {
  const apart = other.sum / other.count - one.sum / one.count;
  return one.spread + other.spread + (apart * apart * one.count * other.count) / (one.count + other.count);
}

/** Returns the value of a series at a time, that is, the most recent value at or before it; null before the first value, and in a gap. */
export function heldAt(series: Series, time_ns: number): number | null {
  let found: number | null = null;
  for (const { times_ns, values, from, to, broken } of series) {
    if (from >= to) continue;
    if ((times_ns[from] as number) > time_ns) return broken ? null : found;
    let low = from;
    let high = to;
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((times_ns[middle] as number) <= time_ns) low = middle + 1;
      else high = middle;
    }
    found = values[low - 1] as number;
    if (low < to) return found;
    if ((times_ns[to - 1] as number) === time_ns) return found;
  }
  return found;
}
