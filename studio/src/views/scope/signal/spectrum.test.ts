// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { measure, measuresOf, spreadOf } from "./measure";
import type { Series } from "./series";
import { peakOf, regular, spectrumOf, spectrumUnit, type WindowFunction } from "./spectrum";

/** Values at these times, s, as a series. */
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

// scipy 1.x: signal.periodogram(x, 1000, window, nfft=512, detrend="constant", scaling), bins 0, 1, 26, 92 and 256.
const BINS = [0, 1, 26, 92, 256];
const SCIPY: Record<WindowFunction, { density: number[]; spectrum: number[] }> = {
  rectangular: {
    density: [0, 0.23771463847731672, 0.05187217631779638, 0.00514209342513181, 7.686224619579983e-6],
    spectrum: [0, 0.7923821282577224, 0.17290725439265464, 0.017140311417106036, 2.562074873193324e-5],
  },
  hann: {
    density: [4.356448699320399e-6, 0.03633736032569012, 0.04566316270457682, 0.0038290998661712023, 0],
    spectrum: [2.1782243496602017e-5, 0.18168680162845047, 0.2283158135228839, 0.019145499330855992, 0],
  },
  hamming: {
    density: [3.479458523312252e-6, 0.05393165064677806, 0.04834473661642014, 0.004143016212177913, 1.237792708785243e-7],
    spectrum: [1.5806319354873035e-5, 0.24499814777125756, 0.21961817937088907, 0.01882069779057502, 5.622986082204537e-7],
  },
  blackman: {
    density: [3.7844601721944265e-6, 0.020228463145233723, 0.04028685633704837, 0.003358740187509278, 0],
    spectrum: [2.1782814974497805e-5, 0.11643215937335968, 0.231885420261998, 0.01933243123800692, 0],
  },
  flattop: {
    density: [1.7400973281711037e-6, 3.085735423519776e-5, 0.019507607213720746, 0.0015921614799802688, 7.770241932437486e-12],
    spectrum: [2.1868652565809604e-5, 0.0003877994339425266, 0.24516162265217523, 0.02000947054550629, 9.765242347188121e-11],
  },
};

test.each(Object.keys(SCIPY) as WindowFunction[])("the spectrum is that of scipy.signal.periodogram: %s", (window) => {
  const of = regular(series(TIMES, SIGNAL), 0, 1e9);
  if (!of) throw new Error("there are values");
  const density = spectrumOf(of, { window, amount: "density" });
  const amplitude = spectrumOf(of, { window, amount: "amplitude" });
  expect(density).toMatchObject({ count: N, held: 0, step_hz: 1000 / 512 });
  expect(density.values).toHaveLength(257);
  BINS.forEach((k, i) => {
    const [power, mean_square] = [SCIPY[window].density[i] as number, SCIPY[window].spectrum[i] as number];
    expect(Math.abs((density.values[k] as number) - power)).toBeLessThan(1e-12 + 1e-9 * power);
    // Of a sine: its amplitude, not the root of its mean square.
    const expected = Math.sqrt(mean_square * (k === 0 || k === 256 ? 1 : 2));
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
