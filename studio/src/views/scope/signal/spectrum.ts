// SPDX-License-Identifier: Apache-2.0
// The spectrum of a trace over a span of time: what `scipy.signal.periodogram` computes, one-sided, the mean taken away, zeros behind the
// values up to a power of two.
import FFT from "fft.js";
import type { Series } from "./series";

/** Window functions, as sums of cosines: rectangular, Hann, Hamming, Blackman, flat top. */
const WINDOWS = {
  rectangular: [1],
  hann: [0.5, 0.5],
  hamming: [0.54, 0.46],
  blackman: [0.42, 0.5, 0.08],
  flattop: [0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368],
} as const;

export type WindowFunction = keyof typeof WINDOWS;
export const WINDOW_FUNCTIONS = Object.keys(WINDOWS) as WindowFunction[];

/** amplitude: of a sine, in the trace's unit; decibel: 20 log10 of it; density: unit²/Hz. */
export const AMOUNTS = ["amplitude", "decibel", "density"] as const;
export type Amount = (typeof AMOUNTS)[number];

export interface SpectrumSetup {
  window: WindowFunction;
  amount: Amount;
  /** The lowest frequency that is shown, Hz; as a rule 0. */
  from_hz?: number;
  /** The highest frequency that is shown, Hz; null: all. */
  to_hz: number | null;
}

export interface Spectrum {
  /** Value k is of the frequency k · `step_hz`. */
  step_hz: number;
  values: Float64Array;
  /** Values of the trace that it is of. */
  count: number;
  /** Of them, those that came at no regular time, or in place of missing ones: the one before was held. */
  held: number;
}

/** Values at regular times. */
export interface Regular {
  step_s: number;
  values: Float64Array;
  held: number;
}

/** Values that a spectrum is computed from at the most: the newest. */
export const COUNT_MAX = 2 ** 20;
/** How far from its regular time a value may be, as a part of the step. */
const UNEVEN = 1e-3;

/** The values between two times at regular ones: as they came where they are; else each is held until the next. Null: fewer than two. */
export function regular(series: Series, from_ns: number, to_ns: number): Regular | null {
  const times: number[] = [];
  const values: number[] = [];
  for (const piece of series) {
    for (let i = piece.from; i < piece.to; i += 1) {
      const time_ns = piece.times_ns[i] as number;
      const value = piece.values[i] as number;
      if (time_ns < from_ns || time_ns > to_ns || value - value !== 0) continue;
      times.push(time_ns);
      values.push(value);
    }
  }
  const step_ns = median(times);
  const [first, last] = [times[0], times.at(-1)];
  if (first === undefined || last === undefined || !(step_ns > 0)) return null;
  const count = Math.min(COUNT_MAX, Math.round((last - first) / step_ns) + 1);
  const made = new Float64Array(count);
  const begin = last - (count - 1) * step_ns;
  let at = 0;
  let held = 0;
  for (let i = 0; i < count; i += 1) {
    const due = begin + i * step_ns;
    while (at + 1 < times.length && (times[at + 1] as number) <= due + UNEVEN * step_ns) at += 1;
    if (Math.abs((times[at] as number) - due) > UNEVEN * step_ns) held += 1;
    made[i] = values[at] as number;
  }
  return { step_s: step_ns / 1e9, values: made, held };
}

/** The middle one of the steps between times; NaN where there is none. */
function median(times: readonly number[]): number {
  const steps = Float64Array.from({ length: Math.max(0, times.length - 1) }, (_, i) => (times[i + 1] as number) - (times[i] as number));
  return steps.sort()[steps.length >> 1] ?? Number.NaN;
}

/** The spectrum of values at regular times. */
export function spectrumOf(of: Regular, { window, amount }: Pick<SpectrumSetup, "window" | "amount">): Spectrum {
  const count = of.values.length;
  const mean = of.values.reduce((sum, value) => sum + value, 0) / count;
  const size = 2 ** Math.max(1, Math.ceil(Math.log2(count)));
  const input = new Float64Array(size);
  let [sum, squares] = [0, 0];
  for (let i = 0; i < count; i += 1) {
    const weight = weightOf(window, i, count);
    sum += weight;
    squares += weight * weight;
    input[i] = ((of.values[i] as number) - mean) * weight;
  }
  const fft = new FFT(size);
  const out = fft.createComplexArray();
  fft.realTransform(out, input);
  const values = new Float64Array(size / 2 + 1);
  for (let k = 0; k < values.length; k += 1) {
    const length = Math.hypot(out[2 * k] as number, out[2 * k + 1] as number);
    // The half of negative frequencies is counted here; 0 and the highest one have none.
    const sides = k === 0 || k === size / 2 ? 1 : 2;
    values[k] =
      amount === "density"
        ? (sides * length * length * of.step_s) / squares
        : amount === "decibel"
          ? 20 * Math.log10((sides * length) / sum)
          : (sides * length) / sum;
  }
  return { step_hz: 1 / (size * of.step_s), values, count, held: of.held };
}

/** Periodic, as for spectra: one that would be followed by its first value again. */
function weightOf(window: WindowFunction, i: number, count: number): number {
  return WINDOWS[window].reduce((sum, a, k) => sum + (k % 2 === 0 ? a : -a) * Math.cos((2 * Math.PI * k * i) / count), 0);
}

/** Unit of what is along y. */
export function spectrumUnit(unit: string | null, amount: Amount): string {
  const of = unit || "1";
  if (amount === "decibel") return `dB re 1 ${of}`;
  return amount === "density" ? `(${of})²/Hz` : of;
}

/** The strongest frequency that is shown, without the one of 0 Hz; null where there is none. */
export function peakOf({ step_hz, values }: Spectrum, to_hz: number | null, from_hz = 0): { hz: number; value: number } | null {
  const end = to_hz === null ? values.length : Math.min(values.length, Math.floor(to_hz / step_hz) + 1);
  let best = -1;
  for (let k = Math.max(1, Math.ceil(from_hz / step_hz)); k < end; k += 1)
    if (best < 0 || (values[k] as number) > (values[best] as number)) best = k;
  const value = values[best];
  return value === undefined || !Number.isFinite(value) ? null : { hz: best * step_hz, value };
}
