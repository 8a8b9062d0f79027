// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { decimate } from "./decimate";
import { derivative, difference } from "./derived";
import { random, runOf } from "./frames.testing";
import { heldAt, measure } from "./measure";
import { Ranges, roundRange } from "./ranges";
import { Ring } from "./ring";
import { missingIn, type Series, seriesOf } from "./series";

function ringOf(values: number[], gapsAt: number[] = []): Ring {
  const ring = new Ring(1, 1e15, 1e6);
  let number = 0;
  values.forEach((value, i) => {
    const lost = gapsAt.includes(i) ? 3 : 0;
    number += 1 + lost;
    ring.take(runOf([number * 100], [value], [number], lost));
  });
  return ring;
}

const all = (ring: Ring): Series => seriesOf(ring, 0, Number.NEGATIVE_INFINITY, Number.POSITIVE_INFINITY);
const flat = (series: Series) => series.flatMap(({ values, from, to }) => [...values.slice(from, to)]);

test("a series breaks where values are missing", () => {
  const ring = ringOf([1, 2, 3, 4], [2]);
  expect(all(ring).map(({ from, to, broken }) => [from, to, broken])).toEqual([[0, 2, false], [2, 4, true]]); // biome-ignore format: a table
  expect(missingIn(ring, 0, 1e6)).toEqual([{ from_ns: 200, to_ns: 600, lost: 3, skipped: 0 }]);
  expect(missingIn(ring, 700, 1e6)).toEqual([]);
});

test("few values are all drawn, each at its place; the pen is lifted at a gap", () => {
  const points = decimate(all(ringOf([1, 2, 3], [2])), 0, 1000, 100);
  expect([...points.x.slice(0, points.count)]).toEqual([10, 20, 20, 60]);
  expect([...points.y.slice(0, points.count)]).toEqual([1, 2, Number.NaN, 3]);
});

test("of many values each pixel column keeps first, least, greatest and last: no peak is lost, and no line is invented", () => {
  for (let seed = 1; seed <= 10; seed += 1) {
    const next = random(seed);
    const width = 20 + Math.floor(next() * 60);
    const values = Array.from({ length: 4000 }, () => Math.round(next() * 1000) / 10);
    const gaps = values.map((_, i) => i).filter(() => next() < 0.001);
    const ring = ringOf(values, gaps);
    const to_ns = (ring.newest_ns as number) + 1;
    const points = decimate(all(ring), 0, to_ns, width);
    expect(points.count).toBeLessThan(5 * (width + 2) + 2 * gaps.length + 8);
    const columns = new Map<number, number[]>();
    for (let i = ring.first; i < ring.end; i += 1) {
      const column = Math.floor((ring.time_ns(i) / to_ns) * width);
      columns.set(column, [...(columns.get(column) ?? []), ring.value(i, 0)]);
    }
    for (const [column, of] of columns) {
      const drawn: number[] = [];
      for (let i = 0; i < points.count; i += 1) {
        const y = points.y[i] as number;
        if (Math.floor(points.x[i] as number) === column && !Number.isNaN(y)) drawn.push(y);
      }
      expect([drawn[0], drawn.at(-1), Math.min(...drawn), Math.max(...drawn)], `seed ${seed}, column ${column}`).toEqual([
        of[0],
        of.at(-1),
        Math.min(...of),
        Math.max(...of),
      ]);
    }
  }
});

test("values that are not finite lift the pen", () => {
  const values = Array.from({ length: 1000 }, (_, i) => (i === 500 ? Number.NaN : 1));
  const points = decimate(all(ringOf(values)), 0, 100_000, 50);
  expect([...points.y.slice(0, points.count)].filter(Number.isNaN)).toHaveLength(1);
});

test("the derivative is per second, and does not go across a gap", () => {
  const series = derivative(all(ringOf([1, 2, 4, 10, 11], [3])));
  expect(flat(series)).toEqual([1e7, 2e7, 1e7]);
  expect(series.map((piece) => piece.broken)).toEqual([false, true]);
});

test("the difference takes the value that the other has then, and nothing where that is not known", () => {
  const one = ringOf([10, 20, 30, 40, 50, 60, 70]);
  const slow = new Ring(1, 1e15, 1e6);
  slow.take(runOf([150, 350], [1, 2], [1, 2]));
  slow.take(runOf([650], [3], [9], 6));
  const series = difference(all(one), all(slow));
  // At 100 no value is known yet; from 400 to 600 they are lost.
  expect(series.map((piece) => [...piece.times_ns])).toEqual([[200, 300], [700]]);
  expect(flat(series)).toEqual([19, 29, 67]);
});

test("measures are over every finite value of the span", () => {
  const series = all(ringOf([3, -1, Number.NaN, 1, 100]));
  expect(measure(series, 0, 400)).toEqual({
    count: 3,
    min: -1,
    max: 3,
    mean: 1,
    rms: Math.sqrt(11 / 3),
    deviation: Math.sqrt(8 / 3),
    peak_to_peak: 4,
  });
  expect(measure(series, 1000, 2000)).toBeNull();
});

test("the value at a cursor is the last one stored before it; before the first and in a gap there is none", () => {
  const series = all(ringOf([1, 2, 3], [2]));
  expect(heldAt(series, 99)).toBeNull();
  expect(heldAt(series, 100)).toBe(1);
  expect(heldAt(series, 199)).toBe(1);
  expect(heldAt(series, 200)).toBe(2);
  expect(heldAt(series, 201)).toBeNull();
  expect(heldAt(series, 600)).toBe(3);
  expect(heldAt(series, 5000)).toBe(3);
});

test("scales hold what is shown, end on round numbers, and stay as long as it fills them", () => {
  for (const [low, high] of [
    [0, 1],
    [-3.7, 12.2],
    [5, 5],
    [1e-6, 3e-6],
    [-1e9, 1e9],
    [0, 0],
  ] as const) {
    // biome-ignore format: a table
    const { lo, hi } = roundRange(low, high);
    expect(lo).toBeLessThan(low);
    expect(hi).toBeGreaterThan(high);
  }
  const ranges = new Ranges();
  const first = ranges.of("a", 0, 10);
  expect(ranges.of("a", 1, 9)).toBe(first);
  expect(ranges.of("a", 1, 2)).not.toEqual(first);
  expect(ranges.of("a", -5, 10).lo).toBeLessThan(-5);
});
