// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { frameOf, type MadeRun, random } from "../signal/frames.testing";
import { Acquisition } from "./acquisition";

const MS = 1e6;
const double = (name: string) => ({ name, type_text: "double", unit: null, components: 1 });

/**
 * Returns a run of a channel with a period of 1 ms, whose values from number `first` on are `of(number)`. The values with the numbers in
 * `drop` are lost.
 */
function run(channel: number, first: number, count: number, of: (number: number) => number, drop: Set<number> = new Set()): MadeRun {
  const numbers = Array.from({ length: count }, (_, i) => first + i).filter((number) => !drop.has(number));
  return { channel, lost: count - numbers.length, times_ns: numbers.map((number) => number * MS), numbers, values: numbers.map(of) };
}

test("triggers at the start of a move, with what was before it", () => {
  const acquisition = new Acquisition();
  acquisition.subscribed(1, [double("sensed"), double("reference")]);
  acquisition.aim("single", 100 * MS, 20 * MS, { channel: "reference", component: "", edge: "rising", level: 0.5, hysteresis: 0 });
  const step = (number: number) => (number >= 500 ? 1 : 0);
  for (let first = 1; first <= 1000; first += 50) {
    acquisition.frame(1, frameOf("s", [run(0, first, 50, Math.sin), run(1, first, 50, step)]).buffer);
  }
  expect(acquisition.sweep.span()).toEqual({ from_ns: 479.5 * MS, to_ns: 579.5 * MS, origin_ns: 499.5 * MS, triggered: true });
  expect(acquisition.sweep.stopped).toBe(true);
  // Values after the sweep are counted, but not stored.
  const ring = acquisition.channels.get("sensed")?.ring;
  expect(ring?.counts).toEqual({ received: 1000, lost: 0, skipped: 400 });
});

test("a frame that is malformed is refused, and nothing of it is taken", () => {
  const acquisition = new Acquisition();
  acquisition.subscribed(1, [double("a")]);
  const spoilt = frameOf("s", [run(0, 1, 10, Number), run(0, 11, 10, Number)]);
  spoilt.setUint32(16 + 8 + 16 + 240, 9, true);
  expect(() => acquisition.frame(1, spoilt.buffer)).toThrow("run 2 is of channel 9, but the subscription has 1");
  expect(acquisition.counts()[0]?.received).toBe(0);
  expect(acquisition.malformed).toBe(1);
});

test("a connection that was made again goes on with the values before, and counts what is missing by number", () => {
  const acquisition = new Acquisition();
  acquisition.subscribed(1, [double("a")]);
  acquisition.frame(1, frameOf("s", [run(0, 1, 10, Number)]).buffer);
  acquisition.subscribed(1, [double("a")]);
  acquisition.frame(1, frameOf("s", [run(0, 31, 10, Number)]).buffer);
  expect(acquisition.counts()[0]).toMatchObject({ received: 20, lost: 20, numbered: 40 });
});

test("a system that was started again begins anew", () => {
  const acquisition = new Acquisition();
  acquisition.subscribed(1, [double("a")]);
  acquisition.frame(1, frameOf("s", [run(0, 100, 10, Number)]).buffer);
  acquisition.subscribed(1, [double("a")]);
  acquisition.frame(1, frameOf("s", [run(0, 1, 10, Number)]).buffer);
  expect(acquisition.counts()[0]).toMatchObject({ received: 10, lost: 0, numbered: 10, kept: 10 });
});

test("64 channels at 1 kHz: received and lost are together what was stored, channel by channel", () => {
  const next = random(7);
  const acquisition = new Acquisition();
  acquisition.keep(4e9);
  acquisition.subscribed(
    1,
    Array.from({ length: 64 }, (_, i) => double(`c${i}`)),
  );
  const lost = new Array<number>(64).fill(0);
  for (let first = 1; first <= 6_000; first += 50) {
    const runs = lost.map((_, channel) => {
      const drop = new Set(next() < 0.02 ? [first + Math.floor(next() * 50), first + 49] : []);
      lost[channel] = (lost[channel] ?? 0) + drop.size;
      return run(channel, first, 50, Number, drop);
    });
    acquisition.frame(1, frameOf("s", runs).buffer);
  }
  acquisition.counts().forEach((counts, channel) => {
    expect(counts.lost).toBe(lost[channel]);
    expect(counts.received + counts.lost).toBe(6_000);
    expect(counts.kept_s).toBeGreaterThanOrEqual(4);
  });
});
