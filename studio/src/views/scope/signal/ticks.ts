// SPDX-License-Identifier: Apache-2.0
// Positions and labels of the marks on an axis.

/** Returns a readable unit for times within a span, and the number of these units per second. */
export function timeUnit(span_s: number): { unit: string; per_s: number } {
  if (span_s < 2e-3) return { unit: "µs", per_s: 1e6 };
  if (span_s < 2) return { unit: "ms", per_s: 1e3 };
  return { unit: "s", per_s: 1 };
}

/**
 * Returns the spacing for about `count` round tick marks between `lo` and `hi`: 1, 2 or 5 times a power of ten. Returns NaN for an empty
 * range.
 */
export function stepOf(lo: number, hi: number, count: number): number {
  const span = hi - lo;
  if (!(span > 0) || !Number.isFinite(span)) return Number.NaN;
  const raw = span / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 5].find((part) => part * power >= raw) ?? 10);
}

/** Returns about `count` round values from `lo` to `hi`; empty for an empty range. */
export function ticks(lo: number, hi: number, count: number): number[] {
  const step = stepOf(lo, hi, count);
  return Number.isNaN(step) ? [] : multiples(lo, hi, step);
}

/** Returns the multiples of `step` from `lo` to `hi`. */
export function multiples(lo: number, hi: number, step: number): number[] {
  // An end that is itself a multiple is included, despite the rounding of the quotient.
  const near = (end: number) => 1e-9 + 4 * Number.EPSILON * Math.abs(end / step);
  const first = Math.ceil(lo / step - near(lo));
  const last = Math.floor(hi / step + near(hi));
  // Rounded to 15 digits, so that 3 · 0.1 gives 0.3.
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => Number(((first + i) * step).toPrecision(15)));
}
