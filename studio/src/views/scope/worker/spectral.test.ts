// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { WatchedValue } from "../../../control/watched";
import { overFrequency } from "../gestures";
import type { Row, Show, ShownTrace } from "../messages";
import { EMPTY, type Setup } from "../setup";
import { Ranges } from "../signal/ranges";
import type { SpectrumSetup } from "../signal/spectrum";
import { spectraOf } from "./spectral";
import { svg } from "./svg";
import type { Behind, Store } from "./traces";

const STEP_S = 0.001;
const sine = (hz: number, amplitude: number, begin_ns = 0): Store => ({
  series: (_channel, _component, from_ns, to_ns) => {
    const times = Float64Array.from({ length: 2000 }, (_, n) => begin_ns + n * STEP_S * 1e9).filter((at) => at >= from_ns && at <= to_ns);
    const values = times.map((at) => amplitude * Math.sin((2 * Math.PI * hz * at) / 1e9));
    return [{ times_ns: times, values, from: 0, to: times.length, broken: false }];
  },
});
const trace: ShownTrace = { id: "y", setup: { channel: "y", component: "", look: 0 }, colour: "red", pattern: [], unit: "V" };
const show = (spectrum: SpectrumSetup): Show & { spectrum: SpectrumSetup } => ({
  width: 400,
  height: 200,
  ratio: 1,
  window: null,
  traces: [trace],
  scales: "unit",
  steps: true,
  xy: null,
  spectrum,
  recorded: false,
  plots: [{ plot: 0, top: 0, height: 200 }],
  cursors: null,
  ink: { text: "black", quiet: "grey", bad: "red", warn: "orange", ground: "white" },
  font: "",
  marker: null,
});
const span = { from_ns: 0, to_ns: 2e9, origin_ns: 0, triggered: false };
const behind: Behind = { ...sine(125, 2, 7e9), origin_ns: 7e9, sums: null };

test("a spectrum is looked at closely, and that of what lies behind is of its own times", () => {
  const found = spectraOf(
    show({ window: "flattop", amount: "amplitude", from_hz: 40, to_hz: 140 }),
    sine(62.5, 3),
    behind,
    span,
    new Ranges(),
  );
  expect(found.x).toEqual({ lo: 40, hi: 140 });
  expect(found.spectra.get("y")?.peak?.hz).toBeCloseTo(62.5, 6);
  expect(found.spectra.get("y")?.peak?.value).toBeCloseTo(3, 6);
  expect(found.behind.get("y")?.peak?.hz).toBeCloseTo(125, 6);
  expect(found.behind.get("y")?.peak?.value).toBeCloseTo(2, 6);
  // The peak is at its frequency, in pixels.
  const [line] = found.lines;
  const points = line?.points;
  if (!points) throw new Error("there is a line");
  const highest = [...points.y.slice(0, points.count)].reduce((best, y, i, all) => (y > (all[best] as number) ? i : best), 0);
  expect(points.x[highest]).toBeCloseTo(((62.5 - 40) / 100) * 400, -1);
});

test("a strongest frequency between two computed ones is the highest point of its line", () => {
  const found = spectraOf(show({ window: "rectangular", amount: "amplitude", to_hz: null }), sine(62.74, 3), null, span, new Ranges());
  const points = found.lines[0]?.points;
  expect(Math.max(...(points?.y.slice(0, points.count) ?? []))).toBeCloseTo(3, 6);
  expect(found.spectra.get("y")?.peak?.hz).toBeCloseTo(62.74, 6);
});

test("what lies outside of the shown frequencies is no peak", () => {
  const found = spectraOf(show({ window: "hann", amount: "amplitude", from_hz: 200, to_hz: 300 }), sine(62.5, 3), null, span, new Ranges());
  expect(found.spectra.get("y")?.peak?.value).toBeLessThan(1e-3);
});

test("the drawing for documents has the line, what lies behind it, and an axis in Hz", () => {
  const of = show({ window: "hann", amount: "decibel", to_hz: null });
  const found = spectraOf(of, sine(62.5, 3), behind, span, new Ranges());
  const text = svg(found.lines, of, { ...found.x, unit: "Hz", per: 1 });
  expect([...text.matchAll(/<path /g)]).toHaveLength(2);
  expect(text.includes(">Hz<")).toBe(true);
  expect(text.includes(">400<")).toBe(true);
});

test("frequencies are zoomed about a place, moved, and shown whole again", () => {
  const setup = new WatchedValue<Setup>({ ...EMPTY, spectrum: { window: "hann", amount: "amplitude", to_hz: null } });
  const rows = new WatchedValue<Row[]>([{ spectrum: { count: 1, held: 0, rate_hz: 1000, peak: null } } as Row]);
  const scope = {
    setup,
    rows,
    along: { lo: 0, hi: 500 },
    change: (next: Setup | ((before: Setup) => Setup)) => {
      setup.set(typeof next === "function" ? next(setup.get()) : next);
      const { from_hz = 0, to_hz } = setup.get().spectrum ?? { to_hz: null };
      scope.along = { lo: from_hz, hi: to_hz ?? 500 };
    },
  };
  const of = overFrequency(scope);
  of.selected(100, 200);
  expect(scope.along).toEqual({ lo: 100, hi: 200 });
  of.zoomed(0.5, 150);
  expect(scope.along).toEqual({ lo: 125, hi: 175 });
  of.moved(1000);
  expect(scope.along).toEqual({ lo: 450, hi: 500 });
  of.zoomed(100, 480);
  expect(setup.get().spectrum).toMatchObject({ from_hz: 0, to_hz: null });
  of.selected(100, 200);
  of.reset();
  expect(setup.get().spectrum).toMatchObject({ from_hz: 0, to_hz: null });
});
