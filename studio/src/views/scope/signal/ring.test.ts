// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { random, runOf } from "./frames.testing";
import { Ring } from "./ring";

const KEEP = 1e12;

/** Returns the contents of a ring: number, time and value, and the number of missing values before each. */
function kept(ring: Ring) {
  const made = [];
  for (let i = ring.first; i < ring.end; i += 1) {
    const gap = ring.gaps.find((one) => one.before === i);
    made.push({ number: ring.number(i), time_ns: ring.time_ns(i), value: ring.value(i, 0), lost: gap?.lost ?? 0 });
  }
  return made;
}

test("keeps values with time and number; the memory grows with them", () => {
  const ring = new Ring(1, KEEP, 1e6);
  const times = Array.from({ length: 5000 }, (_, i) => i * 1000);
  ring.take(runOf(times, times.map(Math.sqrt)));
  expect(ring.end - ring.first).toBe(5000);
  expect(kept(ring)[4321]).toEqual({ number: 4322, time_ns: 4321000, value: Math.sqrt(4321000), lost: 0 });
  expect(ring.bytes).toBe(8192 * 16);
});

test("the newest takes the place of the oldest when `keep_ns` is held, and when there is no more memory", () => {
  const times = Array.from({ length: 5000 }, (_, i) => i * 1000);
  const short = new Ring(1, 1000 * 1000, 1e6);
  short.take(runOf(times, times));
  expect(short.oldest_ns).toBe((5000 - 1024) * 1000);
  const small = new Ring(1, KEEP, 1500);
  small.take(runOf(times, times));
  expect([small.first, small.end]).toEqual([3500, 5000]);
  expect(small.number(3500)).toBe(3501);
});

test("what was lost stands where the numbers jump", () => {
  const ring = new Ring(1, KEEP, 1e6);
  ring.take(runOf([10, 20], [1, 2], [1, 2]));
  ring.take(runOf([40, 50, 90], [4, 5, 9], [4, 5, 9], 4));
  expect(kept(ring).map(({ number, lost }) => [number, lost])).toEqual([[1, 0], [2, 0], [4, 1], [5, 0], [9, 3]]); // biome-ignore format: a table
  expect(ring.counts).toEqual({ received: 5, lost: 4, skipped: 0 });
  expect(ring.numbered).toBe(9);
});

test("a loss that no value has followed yet is open, and closed by the next value", () => {
  const ring = new Ring(1, KEEP, 1e6);
  ring.take(runOf([10], [1], [1]));
  ring.take(runOf([], [], [], 7));
  expect(ring.open).toEqual({ lost: 7, skipped: 0 });
  ring.take(runOf([90], [9], [9]));
  expect(ring.open).toEqual({ lost: 0, skipped: 0 });
  expect(ring.gaps).toEqual([{ before: 1, lost: 7, skipped: 0 }]);
});

test("after a broken connection the numbers say what was lost", () => {
  const ring = new Ring(1, KEEP, 1e6);
  ring.take(runOf([10], [1], [1]));
  ring.resume();
  ring.take(runOf([60, 70], [6, 7], [6, 7]));
  expect(ring.counts).toEqual({ received: 3, lost: 4, skipped: 0 });
  expect(ring.gaps).toEqual([{ before: 1, lost: 4, skipped: 0 }]);
});

test("what comes while the scope is stopped is counted, not kept, and is no loss", () => {
  const ring = new Ring(1, KEEP, 1e6);
  ring.take(runOf([10, 20, 30], [1, 2, 3], [1, 2, 3]), 20);
  ring.take(runOf([40], [4], [4]), 20);
  ring.take(runOf([50], [5], [5]));
  expect(kept(ring).map(({ number }) => number)).toEqual([1, 2, 5]);
  expect(ring.counts).toEqual({ received: 5, lost: 0, skipped: 2 });
  expect(ring.gaps).toEqual([{ before: 2, lost: 0, skipped: 2 }]);
});

test("a program's write has the number of the value before, and its own time", () => {
  const ring = new Ring(1, KEEP, 1e6);
  ring.take(runOf([10, 15, 20], [1, 1.5, 2], [1, 1, 2]));
  expect(kept(ring).map(({ number, value }) => [number, value])).toEqual([[1, 1], [1, 1.5], [2, 2]]); // biome-ignore format: a table
});

test("received and lost are together all that was stored, whatever was lost where, and each gap is at its place", () => {
  for (let seed = 1; seed <= 100; seed += 1) {
    const next = random(seed);
    const ring = new Ring(1, KEEP, 1e6);
    const came: number[] = [1];
    let number = 1;
    let lost = 0;
    let times: number[] = [1];
    const send = () => {
      ring.take(runOf(times.map((one) => one * 1e6), times, times, lost)); // biome-ignore format: short
      times = [];
      lost = 0;
    };
    send();
    for (let i = 0; i < 300; i += 1) {
      number += 1;
      if (next() < 0.2) lost += 1;
      else {
        times.push(number);
        came.push(number);
      }
      if (next() < 0.1) send();
    }
    if (times.length > 0 || lost > 0) send();
    expect(ring.counts.received + ring.counts.lost).toBe(number);
    expect(kept(ring).map((one) => one.number)).toEqual(came);
    const jumps = came.map((one, i) => one - (came[i - 1] ?? 0) - 1);
    expect(kept(ring).map((one) => one.lost), `seed ${seed}`).toEqual(jumps); // biome-ignore format: short
    expect(ring.open.lost).toBe(number - (came.at(-1) ?? 0));
    expect(ring.numbered + ring.open.lost).toBe(number);
  }
});

test("finds times, also where the memory goes round", () => {
  const ring = new Ring(1, KEEP, 1500);
  const times = Array.from({ length: 4000 }, (_, i) => i * 10);
  ring.take(runOf(times, times));
  expect(ring.indexAt(30000)).toBe(3000);
  expect(ring.indexAt(30001)).toBe(3001);
  expect(ring.indexAt(0)).toBe(2500);
  expect(ring.indexAt(1e9)).toBe(4000);
  const all = ring.stretches(2500, 4000).flatMap(({ times_ns, from, to }) => [...times_ns.slice(from, to)]);
  expect(all).toEqual(times.slice(2500));
});
