// SPDX-License-Identifier: Apache-2.0
// The spectrum of a trace over a span of time: as computed by `scipy.signal.periodogram`, one-sided, without the mean, without zero
// padding.
import { dft } from "./dft";
import type { Series } from "./series";
import { sineNear } from "./sine";

/** Window functions as sums of cosines: rectangular, Hann, Hamming, Blackman, flat top. */
const WINDOWS = {
  rectangular: [1],
  hann: [0.5, 0.5],
  hamming: [0.54, 0.46],
  blackman: [0.42, 0.5, 0.08],
  flattop: [0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368],
} as const;

export type WindowFunction = keyof typeof WINDOWS;
export const WINDOW_FUNCTIONS = Object.keys(WINDOWS) as WindowFunction[];

/**
 * `amplitude` is the amplitude of a sine, in the trace's unit; `decibel` is 20 log10 of the amplitude; `density` is the power spectral
 * density, unit²/Hz.
 */
export const AMOUNTS = ["amplitude", "decibel", "density"] as const;
export type Amount = (typeof AMOUNTS)[number];

export interface SpectrumSetup {
  window: WindowFunction;
  amount: Amount;
  /** Lowest frequency shown, Hz; usually 0. */
  from_hz?: number;
  /** Highest frequency shown, Hz; null for all. */
  to_hz: number | null;
}

export interface Spectrum {
  /** Spacing between frequencies: value k is at k · `step_hz`. */
  step_hz: number;
  values: Float64Array;
  /** Number of values of the trace used for the spectrum. */
  count: number;
  /** Number of values that were missing or at irregular times, and were replaced by the previous value. */
  held: number;
  /** Returns the sine at a local maximum; its frequency may lie between those of `values`. Returns null if there is none. */
  sineAt: (k: number) => Peak | null;
}

/** A frequency, and its value in the unit of the spectrum. */
export interface Peak {
  hz: number;
  value: number;
}

/** Equidistant values. */
export interface Regular {
  step_s: number;
  values: Float64Array;
  held: number;
}

/** Maximum number of values in a spectrum; the latest ones are used. */
export const COUNT_MAX = 2 ** 20;
/** Maximum deviation of a value from its regular time, as a fraction of the step. */
const UNEVEN = 1e-3;

/**
 * Resamples the values between two times at regular intervals: values at regular times remain unchanged, and others are held until the
 * next regular time. Returns null if there are fewer than two values.
 */
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

/** Returns the median step between times; NaN if there are no steps. */
function median(times: readonly number[]): number {
  const steps = Float64Array.from({ length: Math.max(0, times.length - 1) }, (_, i) => (times[i + 1] as number) - (times[i] as number));
  return steps.sort()[steps.length >> 1] ?? Number.NaN;
}

/** Computes the spectrum of equidistant values. */
export function spectrumOf(of: Regular, { window, amount }: Pick<SpectrumSetup, "window" | "amount">): Spectrum {
  const count = of.values.length;
  const mean = of.values.reduce((sum, value) => sum + value, 0) / count;
  const weights = weightsOf(window, count);
  const sum = weights.reduce((all, weight) => all + weight, 0);
  const squares = weights.reduce((all, weight) => all + weight * weight, 0);
  const out = dft(weights.map((weight, i) => ((of.values[i] as number) - mean) * weight));
  const shown = (amplitude: number, sides: number) =>
    amount === "density"
      ? (amplitude * amplitude * sum * sum * of.step_s) / (sides * squares)
      : amount === "decibel"
        ? 20 * Math.log10(amplitude)
        : amplitude;
  const amplitudes = new Float64Array(Math.floor(count / 2) + 1);
  // The energy of negative frequencies is included; frequency 0, and the highest one of an even count, have no negative counterpart.
  const sidesOf = (k: number) => (k === 0 || 2 * k === count ? 1 : 2);
  for (let k = 0; k < amplitudes.length; k += 1)
    amplitudes[k] = (sidesOf(k) * Math.hypot(out[2 * k] as number, out[2 * k + 1] as number)) / sum;
  const sineAt = (k: number): Peak | null => {
    const [before, here, after] = [amplitudes[k - 1] ?? 0, amplitudes[k] ?? 0, amplitudes[k + 1] ?? 0];
    if (here < before || here < after) return null;
    // With a flat-top window, an error of the frequency has little effect, so the fit needs another window.
    const found = sineNear(of.values, window === "flattop" ? weightsOf("blackman", count) : weights, k / count);
    // A fit that is much stronger than the spectrum there is of a drift, not of a sine.
    return found && found.amplitude < 2 * here ? { hz: found.cycles / of.step_s, value: shown(found.amplitude, 2) } : null;
  };
  return { step_hz: 1 / (count * of.step_s), values: amplitudes.map((one, k) => shown(one, sidesOf(k))), count, held: of.held, sineAt };
}

/** Returns the weights of a periodic window, as is usual for spectra, that is, without repeating the first weight at the end. */
function weightsOf(window: WindowFunction, count: number): Float64Array {
  const weight = (i: number) =>
    WINDOWS[window].reduce((sum, a, k) => sum + (k % 2 === 0 ? a : -a) * Math.cos((2 * Math.PI * k * i) / count), 0);
  return Float64Array.from({ length: count }, (_, i) => weight(i));
}

/** Returns the unit of the y axis. */
export function spectrumUnit(unit: string | null, amount: Amount): string {
  const of = unit || "1";
  if (amount === "decibel") return `dB re 1 ${of}`;
  return amount === "density" ? `(${of})²/Hz` : of;
}

/** Returns the strongest frequency shown, except 0 Hz, as precisely as the values permit; null if there is none. */
export function peakOf({ step_hz, values, sineAt }: Spectrum, to_hz: number | null, from_hz = 0): Peak | null {
  const end = to_hz === null ? values.length : Math.min(values.length, Math.floor(to_hz / step_hz) + 1);
  let best = -1;
  for (let k = Math.max(1, Math.ceil(from_hz / step_hz)); k < end; k += 1)
    if (best < 0 || (values[k] as number) > (values[best] as number)) best = k;
  const value = values[best];
  if (value === undefined || !Number.isFinite(value)) return null;
  const sine = sineAt(best);
  const isShown = sine !== null && sine.hz >= from_hz && (to_hz === null || sine.hz <= to_hz);
  return isShown ? sine : { hz: best * step_hz, value };
}
