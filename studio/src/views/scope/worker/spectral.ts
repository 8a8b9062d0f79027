// SPDX-License-Identifier: Apache-2.0
import type { RowSpectrum, Show, ShownTrace } from "../messages";
import { decimate, type Points } from "../signal/decimate";
import type { Range, Ranges } from "../signal/ranges";
import type { Series } from "../signal/series";
import { peakOf, regular, type Spectrum, type SpectrumSetup, spectrumOf } from "../signal/spectrum";
import type { Span } from "../signal/sweep";
import { type Canvas, drawLine, extent } from "./draw";
import { placed } from "./placing";
import { type Scales, scaleKey } from "./scales";
import { type Store, traceSeries } from "./traces";

/** Under the strongest frequency what is so many decibels weaker is no more than the digits of the numbers. */
const DECIBELS = 160;

interface Curve {
  trace: ShownTrace;
  points: Points;
}

/** Draws the traces over frequency instead of over time: the spectrum of each over the span. */
export function drawSpectra(
  canvas: Canvas,
  show: Show & { spectrum: SpectrumSetup },
  of: Store,
  span: Span,
  ranges: Ranges,
): Scales & { spectra: ReadonlyMap<string, RowSpectrum> } {
  const { to_hz } = show.spectrum;
  const found = show.traces.flatMap((trace) => {
    const values = regular(traceSeries(of, trace.setup, span.from_ns, span.to_ns), span.from_ns, span.to_ns);
    return values ? [{ trace, spectrum: spectrumOf(values, show.spectrum), rate_hz: 1 / values.step_s }] : [];
  });
  const spectra = new Map(
    found.map(({ trace, spectrum, rate_hz }) => [
      trace.id,
      { count: spectrum.count, held: spectrum.held, rate_hz, peak: peakOf(spectrum, to_hz) },
    ]),
  );
  const hi = to_hz ?? Math.max(1e-9, ...found.map(({ rate_hz }) => rate_hz / 2));
  const curves = found
    .filter(({ trace }) => !trace.setup.hidden)
    .map(({ trace, spectrum }) => ({ trace, points: decimate(overFrequency(spectrum), 0, hi, show.width) }));
  const scales = rangesOf(curves, show, ranges);
  curves.forEach(({ trace, points }, i) => {
    const on = placed(scales[scaleKey(trace, show)] as Range, i, curves.length, trace, show);
    const pen = { colour: trace.colour, pattern: trace.pattern.map((dash) => dash * show.ratio), steps: false };
    canvas.save();
    canvas.beginPath();
    canvas.rect(0, on.top, show.width, on.bottom - on.top);
    canvas.clip();
    drawLine(canvas, points, on, { ...pen, width: 1.5 * show.ratio, alpha: 1 }, show.width);
    canvas.restore();
  });
  return { ranges: scales, x: { lo: 0, hi }, spectra };
}

/** Frequencies in the place of times. */
function overFrequency({ step_hz, values }: Spectrum): Series {
  const hz = Float64Array.from(values, (_, k) => k * step_hz);
  return [{ times_ns: hz, values, from: 0, to: values.length, broken: false }];
}

function rangesOf(curves: readonly Curve[], show: Show & { spectrum: SpectrumSetup }, ranges: Ranges): Record<string, Range> {
  const found = new Map<string, { low: number; high: number; fixed: [number, number] | null }>();
  for (const { trace, points } of curves) {
    const key = scaleKey(trace, show);
    const all = found.get(key) ?? { low: Number.POSITIVE_INFINITY, high: Number.NEGATIVE_INFINITY, fixed: null };
    const { low, high } = extent(points);
    all.high = Math.max(all.high, high);
    all.low = Math.min(all.low, low);
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
