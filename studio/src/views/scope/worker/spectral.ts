// SPDX-License-Identifier: Apache-2.0
import type { RowSpectrum, Show, ShownTrace } from "../messages";
import { decimate } from "../signal/decimate";
import type { Range, Ranges } from "../signal/ranges";
import type { Series } from "../signal/series";
import { type Peak, peakOf, regular, type Spectrum, type SpectrumSetup, spectrumOf } from "../signal/spectrum";
import type { Span } from "../signal/sweep";
import { extent } from "./draw";
import { placed } from "./placing";
import { scaleKey } from "./scales";
import type { Line, PlacedLine } from "./svg";
import { type Behind, type Store, traceSeries } from "./traces";

/** Level below the maximum, in decibels, beyond which values are only rounding errors. */
const DECIBELS = 160;
/** Minimum for the upper end of the frequency axis, Hz. */
const HIGHEST_MIN = 1e-9;

/** Spectra as lines over frequency, and their properties; `behind` is for the traces shown behind. */
export interface Spectra {
  lines: PlacedLine[];
  ranges: Record<string, Range>;
  x: Range;
  spectra: ReadonlyMap<string, RowSpectrum>;
  behind: ReadonlyMap<string, RowSpectrum>;
}

type SpectrumRequest = Show & { spectrum: SpectrumSetup };

interface FoundSpectrum {
  spectrum: Spectrum;
  rate_hz: number;
  peak: Peak | null;
}

/** Computes the spectrum of each trace over the span, and of the store behind it over the same times. */
export function spectraOf(show: SpectrumRequest, of: Store, behind: Behind | null, span: Span, ranges: Ranges): Spectra {
  const shift = (behind?.origin_ns ?? 0) - span.origin_ns;
  const found = show.traces.flatMap((trace) => {
    const own = spectrumAt(show, of, trace, span.from_ns, span.to_ns);
    const earlier = behind && spectrumAt(show, behind, trace, span.from_ns + shift, span.to_ns + shift);
    return own || earlier ? [{ trace, own, earlier }] : [];
  });
  const { from_hz = 0, to_hz } = show.spectrum;
  const rates = found.flatMap(({ own, earlier }) => [own?.rate_hz ?? 0, earlier?.rate_hz ?? 0]);
  const hi = to_hz ?? Math.max(HIGHEST_MIN, ...rates.map((rate_hz) => rate_hz / 2));
  const x = { lo: from_hz < hi ? from_hz : 0, hi };
  const points = (one: FoundSpectrum | null) => decimate(one ? overFrequency(one, x) : [], x.lo, x.hi, show.width);
  const lines = found
    .filter(({ trace }) => !trace.setup.hidden)
    .map(({ trace, own, earlier }): Line => ({ trace, points: points(own), earlier: earlier && points(earlier) }));
  const scales = rangesOf(lines, show, ranges);
  const told = (which: "own" | "earlier") =>
    new Map(found.flatMap(({ trace, [which]: one }) => (one ? [[trace.id, rowOf(one)] as const] : [])));
  return {
    lines: lines.map((line, i) => {
      const key = scaleKey(line.trace, show);
      return { ...line, key, on: placed(scales[key] as Range, i, lines.length, line.trace, show) };
    }),
    ranges: scales,
    x,
    spectra: told("own"),
    behind: told("earlier"),
  };
}

function spectrumAt(show: SpectrumRequest, of: Store, { setup }: ShownTrace, from_ns: number, to_ns: number): FoundSpectrum | null {
  const values = regular(traceSeries(of, setup, from_ns, to_ns), from_ns, to_ns);
  if (!values) return null;
  const spectrum = spectrumOf(values, show.spectrum);
  return { spectrum, rate_hz: 1 / values.step_s, peak: peakOf(spectrum, show.spectrum.to_hz, show.spectrum.from_hz) };
}

function rowOf({ spectrum, rate_hz, peak }: FoundSpectrum): RowSpectrum {
  return { count: spectrum.count, held: spectrum.held, rate_hz, peak };
}

/**
 * Returns the spectrum as a series over frequency: the visible range, plus one value on each side, and the peak if it lies between two
 * values.
 */
function overFrequency({ spectrum: { step_hz, values }, peak }: FoundSpectrum, { lo, hi }: Range): Series {
  const from = Math.max(0, Math.floor(lo / step_hz));
  const to = Math.min(values.length, Math.ceil(hi / step_hz) + 1);
  const hz = Array.from({ length: Math.max(0, to - from) }, (_, k) => (from + k) * step_hz);
  const shown = [...values.subarray(from, to)];
  const after = peak ? hz.findIndex((one) => one > peak.hz) : -1;
  if (peak && after > 0) {
    const isSame = hz[after - 1] === peak.hz ? 1 : 0;
    hz.splice(after - isSame, isSame, peak.hz);
    shown.splice(after - isSame, isSame, peak.value);
  }
  return [{ times_ns: Float64Array.from(hz), values: Float64Array.from(shown), from: 0, to: hz.length, broken: false }];
}

function rangesOf(lines: readonly Line[], show: SpectrumRequest, ranges: Ranges): Record<string, Range> {
  const found = new Map<string, { low: number; high: number; fixed: [number, number] | null }>();
  for (const { trace, points, earlier } of lines) {
    const key = scaleKey(trace, show);
    const all = found.get(key) ?? { low: Number.POSITIVE_INFINITY, high: Number.NEGATIVE_INFINITY, fixed: null };
    for (const one of earlier ? [points, earlier] : [points]) {
      const { low, high } = extent(one);
      all.high = Math.max(all.high, high);
      all.low = Math.min(all.low, low);
    }
    all.fixed ??= trace.setup.range ?? null;
    found.set(key, all);
  }
  const isLevel = show.spectrum.amount === "decibel";
  return Object.fromEntries(
    [...found].map(([key, { low, high, fixed }]) => {
      const least = isLevel ? Math.max(low, high - DECIBELS) : low;
      return [key, fixed ? { lo: fixed[0], hi: fixed[1] } : ranges.of(key, least, high)];
    }),
  );
}
