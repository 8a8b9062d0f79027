// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { random } from "./frames.testing";
import { Sweep } from "./sweep";
import { type Edge, EdgeFinder } from "./trigger";

function crossings(edge: Edge, level: number, values: (number | null)[], hysteresis = 0): number[] {
  const finder = new EdgeFinder(edge, level, hysteresis);
  const found: number[] = [];
  values.forEach((value, i) => {
    if (value === null) finder.gap();
    const at = value === null ? null : finder.next(i * 100, value);
    if (at !== null) found.push(at);
  });
  return found;
}

test("finds where the signal crosses, between two values", () => {
  const wave = [0, 1, 2, 1, 0, 1, 2];
  expect(crossings("rising", 1.5, wave)).toEqual([150, 550]);
  expect(crossings("falling", 1.5, wave)).toEqual([250]);
  expect(crossings("either", 1.5, wave)).toEqual([150, 250, 550]);
});

test("a signal that begins above the level has not crossed it", () => {
  expect(crossings("rising", 1, [3, 4, 5])).toEqual([]);
});

test("what happened in a gap is not known", () => {
  expect(crossings("rising", 1, [0, null, 2, 0, 2])).toEqual([350]);
  expect(crossings("rising", 1, [0, Number.NaN, 2, 0, 2])).toEqual([350]);
});

test("noise does not trigger again within the hysteresis", () => {
  const noisy = [0, 1.1, 0.9, 1.1, 0.9, 1.1, 0, 1.1];
  expect(crossings("rising", 1, noisy)).toHaveLength(4);
  expect(crossings("rising", 1, noisy, 0.5)).toHaveLength(2);
});

test("every crossing is found once, as by looking at each pair of neighbours", () => {
  for (let seed = 1; seed <= 100; seed += 1) {
    const next = random(seed);
    const values = Array.from({ length: 200 }, () => (next() < 0.1 ? null : Math.round(next() * 8) - 4));
    const naive = values.flatMap((value, i) => {
      const before = values[i - 1];
      return typeof value === "number" && typeof before === "number" && before < 1 && value >= 1 ? [i] : [];
    });
    const found = crossings("rising", 1, values);
    expect(found.map((at) => Math.ceil(at / 100)), `seed ${seed}`).toEqual(naive); // biome-ignore format: short
  }
});

const MS = 1e6;

test("roll shows the newest", () => {
  const sweep = new Sweep("roll", 100 * MS, 20 * MS);
  expect(sweep.span()).toBeNull();
  sweep.reached(500 * MS);
  expect(sweep.triggered(450 * MS)).toBe(false);
  expect(sweep.span()).toEqual({ from_ns: 400 * MS, to_ns: 500 * MS, origin_ns: 500 * MS, triggered: false });
});

test("normal goes from trigger to trigger, and takes none while one is not complete", () => {
  const sweep = new Sweep("normal", 100 * MS, 20 * MS);
  sweep.reached(1000 * MS);
  expect(sweep.triggered(1010 * MS)).toBe(true);
  expect(sweep.state).toBe("collecting");
  expect(sweep.triggered(1050 * MS)).toBe(false);
  sweep.reached(1090 * MS);
  expect(sweep.state).toBe("waiting");
  expect(sweep.triggered(1089 * MS)).toBe(false);
  expect(sweep.triggered(1200 * MS)).toBe(true);
  expect(sweep.span()).toEqual({ from_ns: 1180 * MS, to_ns: 1280 * MS, origin_ns: 1200 * MS, triggered: true });
  sweep.reached(9000 * MS);
  expect(sweep.span()?.origin_ns).toBe(1200 * MS);
});

test("auto shows the newest where no trigger comes", () => {
  const sweep = new Sweep("auto", 100 * MS, 20 * MS);
  sweep.reached(1000 * MS);
  expect(sweep.span()?.triggered).toBe(false);
  sweep.triggered(1010 * MS);
  sweep.reached(1500 * MS);
  expect(sweep.span()?.triggered).toBe(true);
  sweep.reached(1600 * MS);
  expect(sweep.span()).toEqual({ from_ns: 1500 * MS, to_ns: 1600 * MS, origin_ns: 1600 * MS, triggered: false });
});

test("single stops when its one trigger is complete, until it is armed", () => {
  const sweep = new Sweep("single", 100 * MS, 20 * MS);
  sweep.reached(1000 * MS);
  sweep.triggered(1010 * MS);
  expect(sweep.stopped).toBe(false);
  sweep.reached(1091 * MS);
  expect(sweep.stopped).toBe(true);
  expect(sweep.triggered(1200 * MS)).toBe(false);
  sweep.arm(1300 * MS);
  expect(sweep.triggered(1299 * MS)).toBe(false);
  expect(sweep.triggered(1301 * MS)).toBe(true);
});

test("sweeps never overlap, and begin at triggers only, whatever comes", () => {
  const wrong: string[] = [];
  for (let seed = 1; seed <= 200; seed += 1) {
    const next = random(seed);
    const sweep = new Sweep("normal", 50, 10);
    let time = 0;
    let ending = Number.NEGATIVE_INFINITY;
    for (let i = 0; i < 300; i += 1) {
      time += 1 + Math.floor(next() * 20);
      sweep.reached(time);
      if (next() < 0.5) continue;
      const begins = sweep.triggered(time);
      if (begins !== time >= ending) wrong.push(`seed ${seed}, at ${time}: ${begins}`);
      if (begins) ending = time - 10 + 50;
      if (sweep.span()?.to_ns !== ending) wrong.push(`seed ${seed}, at ${time}: shown to ${sweep.span()?.to_ns}, not ${ending}`);
    }
  }
  expect(wrong).toEqual([]);
});
