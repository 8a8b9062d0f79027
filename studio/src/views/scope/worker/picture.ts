// SPDX-License-Identifier: Apache-2.0
import { tr } from "../../../language/text";
import type { Row, RowSpectrum, Show, ShownTrace } from "../messages";
import { decimate } from "../signal/decimate";
import { rangeText } from "../signal/labels";
import { heldAt, measure, measuresOf } from "../signal/measure";
import { type Range, Ranges } from "../signal/ranges";
import type { Series } from "../signal/series";
import type { SpectrumSetup } from "../signal/spectrum";
import type { Span } from "../signal/sweep";
import { timeUnit } from "../signal/ticks";
import { type Acquisition, sumsKey } from "./acquisition";
import { type Canvas, drawLine, drawMissing, extent, type PlacedScale } from "./draw";
import { placed } from "./placing";
import { type Scales, scaleKey } from "./scales";
import { type Spectra, spectraOf } from "./spectral";
import { type Line, svg } from "./svg";
import { type Behind, live, missingOf, type Store, traceSeries } from "./traces";
import { drawXy } from "./xy";

/** Draws and measures the shown traces. */
export class Picture {
  reference: Behind | null = null;
  /** Reference with all values of the span, for spectra of a recording. */
  wholeReference: Behind | null = null;
  readonly #acquisition: Acquisition;
  /** All values of a recording within the span, for spectra. */
  readonly #whole: Acquisition;
  #spectra: ReadonlyMap<string, RowSpectrum> = new Map();
  #spectraBehind: ReadonlyMap<string, RowSpectrum> = new Map();
  readonly #ranges = new Ranges();
  #scaled = "";

  constructor(acquisition: Acquisition, whole: Acquisition) {
    this.#acquisition = acquisition;
    this.#whole = whole;
  }

  draw(canvas: Canvas, show: Show, span: Span): Scales {
    const { spectrum } = show;
    const scaled = `${show.scales} ${show.xy} ${spectrum?.amount}`;
    if (scaled !== this.#scaled) this.#ranges.forget();
    this.#scaled = scaled;
    if (show.xy !== null) return drawXy(canvas, show, live(this.#acquisition), span, this.#ranges);
    [this.#spectra, this.#spectraBehind] = [new Map(), new Map()];
    if (spectrum) {
      const { lines, ranges, x, spectra, behind } = this.#spectral({ ...show, spectrum }, span);
      [this.#spectra, this.#spectraBehind] = [spectra, behind];
      for (const line of lines) stroke(canvas, line, { ...show, steps: false });
      return { ranges, x };
    }
    const per_ns = show.width / (span.to_ns - span.from_ns);
    const lines = this.#lines(show, span);
    const ranges = this.#rangesOf(lines, show);
    const missing = missingOf(this.#acquisition, show.traces, span.from_ns, span.to_ns);
    drawMissing(canvas, missing, { from_ns: span.from_ns, per_ns, ...sizes(show) }, { ...show.ink, font: show.font });
    lines.forEach((line, i) => {
      const on = placed(ranges[scaleKey(line.trace, show)] as Range, i, lines.length, line.trace, show);
      stroke(canvas, { ...line, on }, show, () => {
        if (show.scales === "lanes") lane(canvas, line.trace, on, i, show);
        marker(canvas, line.trace, on, show);
      });
    });
    return { ranges, x: null };
  }

  rows(show: Show, span: Span): Row[] {
    const of = live(this.#acquisition);
    const rows = show.traces.map((trace) => ({
      ...exact(row(of, trace, show, span, false), trace, this.#acquisition.sums),
      spectrum: this.#spectra.get(trace.id) ?? null,
    }));
    const reference = this.reference;
    if (!reference) return rows;
    const moved = reference.origin_ns - span.origin_ns;
    const then = { ...span, from_ns: span.from_ns + moved, to_ns: span.to_ns + moved, origin_ns: reference.origin_ns };
    const behind = show.traces.map((trace) => ({
      ...exact(row(reference, trace, show, then, true), trace, reference.sums),
      spectrum: this.#spectraBehind.get(trace.id) ?? null,
    }));
    return [...rows, ...behind.filter((one) => one.measures !== null)];
  }

  /** Returns the picture as SVG, for documents. Throws an `Error` if the x axis shows the values of a trace. */
  svg(show: Show, span: Span): string {
    const { spectrum } = show;
    if (show.xy !== null) throw new Error(tr("scope.sVGShowsTracesOverTimeOr"));
    if (spectrum) {
      const { lines, x } = this.#spectral({ ...show, spectrum }, span);
      return svg(lines, { ...show, steps: false }, { ...x, unit: "Hz", per: 1 });
    }
    const lines = this.#lines(show, span);
    const ranges = this.#rangesOf(lines, show);
    const placedLines = lines.map((line, i) => ({
      ...line,
      on: placed(ranges[scaleKey(line.trace, show)] as Range, i, lines.length, line.trace, show),
      key: scaleKey(line.trace, show),
    }));
    const [lo, hi] = [(span.from_ns - span.origin_ns) / 1e9, (span.to_ns - span.origin_ns) / 1e9];
    const { unit, per_s } = timeUnit(hi - lo);
    return svg(placedLines, show, { lo, hi, unit, per: per_s });
  }

  #spectral(show: Show & { spectrum: SpectrumSetup }, span: Span): Spectra {
    const [of, behind] = show.recorded ? [this.#whole, this.wholeReference] : [this.#acquisition, this.reference];
    return spectraOf(show, live(of), behind, span, this.#ranges);
  }

  #lines(show: Show, span: Span): Line[] {
    const of = live(this.#acquisition);
    const moved = (this.reference?.origin_ns ?? 0) - span.origin_ns;
    const drawn = (store: Store, trace: ShownTrace, shift: number) => {
      const from = span.from_ns + shift;
      const to = span.to_ns + shift;
      return decimate(traceSeries(store, trace.setup, from, to), from, to, show.width);
    };
    return show.traces
      .filter((trace) => !trace.setup.hidden)
      .map((trace) => ({ trace, points: drawn(of, trace, 0), earlier: this.reference && drawn(this.reference, trace, moved) }));
  }

  #rangesOf(lines: readonly Line[], show: Show): Record<string, Range> {
    const extents = new Map<string, { low: number; high: number; fixed: [number, number] | null }>();
    for (const { trace, points, earlier } of lines) {
      const key = scaleKey(trace, show);
      const all = extents.get(key) ?? { low: Number.POSITIVE_INFINITY, high: Number.NEGATIVE_INFINITY, fixed: null };
      for (const one of earlier ? [points, earlier] : [points]) {
        const { low, high } = extent(one);
        all.low = Math.min(all.low, low);
        all.high = Math.max(all.high, high);
      }
      all.fixed ??= trace.setup.range ?? null;
      extents.set(key, all);
    }
    return Object.fromEntries(
      [...extents].map(([key, { low, high, fixed }]) => [key, fixed ? { lo: fixed[0], hi: fixed[1] } : this.#ranges.of(key, low, high)]),
    );
  }
}

function stroke(canvas: Canvas, { trace, points, earlier, on }: Line & { on: PlacedScale }, show: Show, more?: () => void): void {
  canvas.save();
  canvas.beginPath();
  canvas.rect(0, on.top, show.width, on.bottom - on.top);
  canvas.clip();
  const pen = { colour: trace.colour, pattern: trace.pattern.map((dash) => dash * show.ratio), steps: show.steps };
  if (earlier) drawLine(canvas, earlier, on, { ...pen, width: show.ratio, alpha: 0.45 }, show.width);
  drawLine(canvas, points, on, { ...pen, width: 1.5 * show.ratio, alpha: 1 }, show.width);
  more?.();
  canvas.restore();
}

// For a recording not every value is sent, but the sums over all values are.
function exact(measured: Row, { setup }: ShownTrace, known: Acquisition["sums"] | null): Row {
  const sums = setup.derive ? undefined : known?.get(sumsKey(setup.channel, setup.component ?? ""));
  return sums ? { ...measured, measures: measuresOf(sums) } : measured;
}

function sizes(show: Show): { width: number; height: number; ratio: number } {
  return { width: show.width, height: show.height, ratio: show.ratio };
}

/** Draws the frame of lane `i`: a line at its top, and the name and range of its trace, if there is enough space for a line of text. */
export function lane(canvas: Canvas, trace: ShownTrace, on: PlacedScale, i: number, show: Show): void {
  canvas.save();
  canvas.font = show.font;
  canvas.textBaseline = "top";
  if (i > 0) {
    canvas.globalAlpha = 0.25;
    canvas.fillStyle = show.ink.quiet;
    canvas.fillRect(0, Math.round(on.top), show.width, show.ratio);
    canvas.globalAlpha = 1;
  }
  if (on.bottom - on.top >= 14 * show.ratio) {
    const unit = trace.unit ? ` ${trace.unit}` : "";
    const text = `${trace.id}  ${rangeText(on.lo, on.hi)}${unit}`;
    canvas.globalAlpha = 0.85;
    canvas.fillStyle = show.ink.ground;
    canvas.fillRect(2 * show.ratio, on.top + show.ratio, canvas.measureText(text).width + 6 * show.ratio, 13 * show.ratio);
    canvas.globalAlpha = 1;
    canvas.fillStyle = trace.colour;
    canvas.fillText(text, 5 * show.ratio, on.top + 2 * show.ratio);
  }
  canvas.restore();
}

function marker(canvas: Canvas, { setup, colour }: ShownTrace, on: PlacedScale, show: Show): void {
  const { marker: at, ratio } = show;
  if (!at || setup.derive || setup.channel !== at.channel || (setup.component ?? "") !== at.component) return;
  const y = on.bottom + ((at.level - on.lo) / (on.hi - on.lo)) * (on.top - on.bottom);
  canvas.save();
  canvas.fillStyle = colour;
  canvas.beginPath();
  canvas.moveTo(0, y - 5 * ratio);
  canvas.lineTo(8 * ratio, y);
  canvas.lineTo(0, y + 5 * ratio);
  canvas.fill();
  canvas.strokeStyle = colour;
  canvas.globalAlpha = 0.5;
  canvas.lineWidth = ratio;
  canvas.setLineDash([2 * ratio, 4 * ratio]);
  canvas.beginPath();
  canvas.moveTo(0, y);
  canvas.lineTo(show.width, y);
  canvas.stroke();
  canvas.restore();
}

function row(of: Store, trace: ShownTrace, show: Show, span: Span, reference: boolean): Row {
  const series: Series = traceSeries(of, trace.setup, span.from_ns, span.to_ns);
  const last = series.at(-1);
  const at = (cursor: number | undefined) => (cursor === undefined ? null : heldAt(series, span.origin_ns + cursor * 1e9));
  return {
    id: trace.id,
    spectrum: null,
    measures: measure(series, span.from_ns, span.to_ns),
    a: at(show.cursors?.[0]),
    b: at(show.cursors?.[1]),
    newest: last ? (last.values[last.to - 1] as number) : null,
    reference,
  };
}
