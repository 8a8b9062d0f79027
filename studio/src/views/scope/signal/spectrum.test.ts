// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { randomOf } from "../../../../tests/randomActions";
import { measure, measuresOf, spreadOf } from "./measure";
import type { Series } from "./series";
import { type Amount, peakOf, regular, spectrumOf, spectrumUnit, WINDOW_FUNCTIONS, type WindowFunction } from "./spectrum";

/** Returns values at these times, s, as a series. */
function series(times_s: number[], values: number[]): Series {
  return [
    {
      times_ns: Float64Array.from(times_s, (time) => Math.round(time * 1e9)),
      values: Float64Array.from(values),
      from: 0,
      to: values.length,
      broken: false,
    },
  ];
}

const N = 300;
const TIMES = Array.from({ length: N }, (_, n) => n / 1000);
const SIGNAL = TIMES.map((t, n) => 1.5 + 0.7 * Math.sin(2 * Math.PI * 50 * t) + 0.2 * Math.cos(2 * Math.PI * 180.3 * t) + 0.01 * n);

// scipy 1.17: signal.periodogram(x, 1000, window, detrend="constant", scaling), bins 0, 1, 15, 54 and 150.
const BINS = [0, 1, 15, 54, 150];
const SCIPY: Record<WindowFunction, { density: number[]; spectrum: number[] }> = {
  rectangular: {
    density: [6.576937912624731e-33, 0.13678774886138742, 0.060840371401728585, 0.005595381701636152, 7.686224619580625e-6],
    spectrum: [2.0981351648052977e-32, 0.4559591628712915, 0.202801238005762, 0.01865127233878717, 2.562074873193532e-5],
  },
  hann: {
    density: [4.356448699320066e-6, 0.05129602735309001, 0.04903980473641665, 0.0039583372007821905, 6.121862175319683e-17],
    spectrum: [2.1782243496600317e-5, 0.25648013676544984, 0.24519902368208296, 0.01979168600391094, 3.060931089206424e-16],
  },
  hamming: {
    density: [3.4794585233119558e-6, 0.062172848726839404, 0.05253601878233595, 0.004314529875108762, 1.2377927087855206e-7],
    spectrum: [1.580631935487177e-5, 0.2824358720169866, 0.23865813744970643, 0.019599841933793126, 5.622986082205874e-7],
  },
  blackman: {
    density: [3.7844601721941695e-6, 0.0323362306811501, 0.04257979127556142, 0.0034465413269861734, 9.755406747901902e-18],
    spectrum: [2.1782814974496324e-5, 0.18612274878076954, 0.24508322793907808, 0.019837802120181186, 5.615073520362074e-17],
  },
  flattop: {
    density: [1.7400973281710197e-6, 0.0006590292804021365, 0.019498203875016325, 0.001591746511606407, 7.770241932174552e-12],
    spectrum: [2.1868652565808673e-5, 0.008282342677324526, 0.24504344630436037, 0.02000425543538178, 9.76524234685213e-11],
  },
};

test.each(Object.keys(SCIPY) as WindowFunction[])("the spectrum is that of scipy.signal.periodogram: %s", (window) => {
  const of = regular(series(TIMES, SIGNAL), 0, 1e9);
  if (!of) throw new Error("there are values");
  const density = spectrumOf(of, { window, amount: "density" });
  const amplitude = spectrumOf(of, { window, amount: "amplitude" });
  expect(density).toMatchObject({ count: N, held: 0, step_hz: expect.closeTo(1000 / 300, 9) });
  expect(density.values).toHaveLength(151);
  BINS.forEach((k, i) => {
    const [power, mean_square] = [SCIPY[window].density[i] as number, SCIPY[window].spectrum[i] as number];
    expect(Math.abs((density.values[k] as number) - power)).toBeLessThan(1e-12 + 1e-9 * power);
    // The result is the amplitude of a sine, not its root mean square.
    const expected = Math.sqrt(mean_square * (k === 0 || k === 150 ? 1 : 2));
    expect(Math.abs((amplitude.values[k] as number) - expected)).toBeLessThan(1e-7 + 1e-9 * expected);
  });
});

test("a sine's amplitude and frequency are read off, in decibels too", () => {
  const times = Array.from({ length: 1024 }, (_, n) => n * 0.002);
  const of = regular(
    series(
      times,
      times.map((t) => 5 + 3 * Math.sin(2 * Math.PI * 62.5 * t)),
    ),
    0,
    1e10,
  );
  if (!of) throw new Error("there are values");
  const found = peakOf(spectrumOf(of, { window: "flattop", amount: "amplitude" }), null);
  expect(found?.hz).toBeCloseTo(62.5, 6);
  expect(found?.value).toBeCloseTo(3, 6);
  expect(peakOf(spectrumOf(of, { window: "hann", amount: "decibel" }), null)?.value).toBeCloseTo(20 * Math.log10(3), 6);
  expect(peakOf(spectrumOf(of, { window: "hann", amount: "amplitude" }), 40)?.hz).toBeLessThanOrEqual(40);
  expect([spectrumUnit("rad", "density"), spectrumUnit(null, "decibel")]).toEqual(["(rad)²/Hz", "dB re 1 1"]);
});

test("a sine reads its frequency and its amplitude, whatever its phase, its length and the window", () => {
  const next = randomOf(9);
  for (let time = 0; time < 100; time += 1) {
    const count = 32 + Math.floor(1500 * next());
    const step_s = 10 ** (-5 + 4 * next());
    const cycles = 2 + (0.45 * count - 2) * next() ** 3;
    const hz = cycles / (count * step_s);
    const [amplitude, phase, offset] = [10 ** (6 * next() - 3), 2 * Math.PI * next(), 3 * next()];
    const values = Float64Array.from({ length: count }, (_, n) => amplitude * (offset + Math.sin(2 * Math.PI * hz * n * step_s + phase)));
    for (const window of WINDOW_FUNCTIONS) {
      // Closer to 0, the main lobe overlaps that of the negative frequency.
      if (cycles < { rectangular: 2, hann: 2, hamming: 2, blackman: 3, flattop: 6 }[window]) continue;
      const about = `${cycles} cycles in ${count} values, phase ${phase}, ${window}`;
      const peak = (amount: Amount) => peakOf(spectrumOf({ step_s, values, held: 0 }, { window, amount }), null);
      const found = peak("amplitude");
      expect(Math.abs((found?.hz ?? 0) / hz - 1), about).toBeLessThan(1e-3);
      expect(Math.abs((found?.value ?? 0) / amplitude - 1), about).toBeLessThan(1e-3);
      expect(Math.abs((peak("decibel")?.value ?? 0) - 20 * Math.log10(amplitude)), about).toBeLessThan(0.01);
    }
  }
});

test("the stronger of two sines, in noise, is read within a thousandth", () => {
  const next = randomOf(4);
  const values = Float64Array.from(
    { length: 1000 },
    (_, n) => Math.sin(0.0628318 * n + 1) + 0.3 * Math.sin(0.31 * n) + 0.01 * (next() - 0.5),
  );
  const found = peakOf(spectrumOf({ step_s: 0.01, values, held: 0 }, { window: "hann", amount: "amplitude" }), null);
  expect(Math.abs((found?.hz ?? 0) - 1)).toBeLessThan(1e-3);
  expect(Math.abs((found?.value ?? 0) - 1)).toBeLessThan(1e-3);
});

test("of what is no sine the strongest of the computed frequencies is told", () => {
  const ramp = Float64Array.from({ length: 1000 }, (_, n) => n);
  const of = spectrumOf({ step_s: 0.001, values: ramp, held: 0 }, { window: "hann", amount: "amplitude" });
  const found = peakOf(of, null);
  expect(found?.hz).toBeCloseTo(1, 1);
  expect(found?.value).toBeLessThan(1.1 * Math.max(...of.values));
});

test("what did not come at its time is held, and counted", () => {
  const times = TIMES.slice(0, 20).filter((_, n) => n !== 7 && n !== 8);
  const of = regular(series(times, times), 0, 1e9);
  expect(of?.held).toBe(2);
  expect(of?.values).toHaveLength(20);
  expect([of?.values[6], of?.values[7], of?.values[8], of?.values[9]]).toEqual([0.006, 0.006, 0.006, 0.009]);
  expect(regular(series([0.5], [1]), 0, 1e9)).toBeNull();
});

test("a standard deviation among large values keeps its digits, and that of two parts is that of the whole", () => {
  const values = Array.from({ length: 1000 }, (_, n) => 1e9 + (n % 2 === 0 ? 1 : -1));
  const times = values.map((_, n) => n / 1000);
  expect(measure(series(times, values))?.deviation).toBeCloseTo(1, 9);
  const part = (from: number, to: number) => {
    const own = values.slice(from, to);
    const mean = own.reduce((sum, value) => sum + value, 0) / own.length;
    const spread = own.reduce((sum, value) => sum + (value - mean) ** 2, 0);
    return { count: own.length, min: 0, max: 0, sum: mean * own.length, squares: 0, spread };
  };
  const whole = { ...part(0, 1000), spread: spreadOf(part(0, 301), part(301, 1000)) };
  expect(measuresOf(whole)?.deviation).toBeCloseTo(1, 6);
});
