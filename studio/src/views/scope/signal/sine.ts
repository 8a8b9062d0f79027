// SPDX-License-Identifier: Apache-2.0

/** A sine wave in equidistant values: cycles per value, and amplitude. */
export interface Sine {
  cycles: number;
  amplitude: number;
}

const ROUNDS_MAX = 30;
/** Minimum number of values for fitting a sine. */
const COUNT_MIN = 8;

/**
 * Returns the sine with an offset that best fits the values, near `cycles` per value; null if none is found within 1.5 bins.
 *
 * The method is the four-parameter fit of IEEE Std 1057, weighted by the window of the spectrum. For a single sine it is exact for any
 * phase, window and number of cycles; the window suppresses other sines as in the spectrum.
 */
export function sineNear(values: Float64Array, weights: Float64Array, cycles: number): Sine | null {
  const count = values.length;
  if (count < COUNT_MIN) return null;
  const bin = (2 * Math.PI) / count;
  const begin = 2 * Math.PI * cycles;
  let turn = begin;
  let found: Fit | null = null;
  for (let round = 0; round < ROUNDS_MAX; round += 1) {
    found = gaussNewton(values, weights, turn, found);
    if (!found) return null;
    turn += found.step;
    if (!(Math.abs(turn - begin) <= 1.5 * bin && turn > 0 && turn < Math.PI)) return null;
    if (round > 1 && Math.abs(found.step) < 1e-7 * bin) {
      return { cycles: turn / (2 * Math.PI), amplitude: Math.hypot(found.cos, found.sin) };
    }
  }
  return null;
}

interface Fit {
  cos: number;
  sin: number;
  /** Correction of the angle per value. */
  step: number;
}

/** Performs one Gauss-Newton step from the fit `before`. If `before` is null, fits offset and amplitude for a fixed angle per value. */
function gaussNewton(values: Float64Array, weights: Float64Array, turn: number, before: Fit | null): Fit | null {
  const count = values.length;
  const middle = (count - 1) / 2;
  const size = before ? 4 : 3;
  const sums = Array.from({ length: size }, () => new Float64Array(size + 1));
  const row = new Float64Array(size + 1);
  for (let n = 0; n < count; n += 1) {
    const at = n - middle;
    const [cos, sin] = [Math.cos(turn * at), Math.sin(turn * at)];
    row[0] = 1;
    row[1] = cos;
    row[2] = sin;
    // Scaled to the magnitude of the other columns.
    if (before) row[3] = ((before.sin * cos - before.cos * sin) * at) / middle;
    row[size] = values[n] as number;
    const weight = weights[n] as number;
    for (let i = 0; i < size; i += 1) {
      const sum = sums[i] as Float64Array;
      const weighted = weight * (row[i] as number);
      for (let k = i; k <= size; k += 1) sum[k] = (sum[k] as number) + weighted * (row[k] as number);
    }
  }
  for (let i = 1; i < size; i += 1) for (let k = 0; k < i; k += 1) (sums[i] as Float64Array)[k] = (sums[k] as Float64Array)[i] as number;
  const solved = solve(sums);
  if (!solved) return null;
  return { cos: solved[1] as number, sin: solved[2] as number, step: before ? (solved[3] as number) / middle : 0 };
}

/**
 * Solves linear equations by Gaussian elimination with pivoting; the last column is the right-hand side. Returns null if there is no
 * unique solution.
 */
function solve(rows: Float64Array[]): number[] | null {
  const size = rows.length;
  const at = (i: number, k: number) => (rows[i] as Float64Array)[k] as number;
  for (let column = 0; column < size; column += 1) {
    let best = column;
    for (let i = column + 1; i < size; i += 1) if (Math.abs(at(i, column)) > Math.abs(at(best, column))) best = i;
    if (!(Math.abs(at(best, column)) > 0)) return null;
    [rows[column], rows[best]] = [rows[best] as Float64Array, rows[column] as Float64Array];
    for (let i = column + 1; i < size; i += 1) {
      const part = at(i, column) / at(column, column);
      for (let k = column; k <= size; k += 1) (rows[i] as Float64Array)[k] = at(i, k) - part * at(column, k);
    }
  }
  const solved = new Array<number>(size).fill(0);
  for (let i = size - 1; i >= 0; i -= 1) {
    let rest = at(i, size);
    for (let k = i + 1; k < size; k += 1) rest -= at(i, k) * (solved[k] as number);
    solved[i] = rest / at(i, i);
  }
  return solved.every(Number.isFinite) ? solved : null;
}
