// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { clockText, count, dayText, duration, percent, period, reading, seconds, valueText } from "./numbers";

test("durations in the unit that suits them, periods exactly", () => {
  expect([850, 16_384, 1_000_000, 2.5e9].map((ns) => duration(ns))).toEqual(["850 ns", "16.4 µs", "1.00 ms", "2.50 s"]);
  expect([500_000, 1_000_000, 20_000_000, 2e9].map((ns) => period(ns))).toEqual(["500 µs", "1 ms", "20 ms", "2 s"]);
  expect(duration(null)).toBe("–");
});

test("values by their type", () => {
  expect(valueText(1, true)).toBe("1.0000");
  expect(valueText(1)).toBe("1");
  expect(valueText(9e-33, true)).toBe("0.0000");
  expect(valueText(3e-6, true)).toBe("3.000e-6");
  expect(valueText([1, -0.5], true)).toBe("[1.0000, -0.5000]");
  expect(valueText({ on: true, level: 2 })).toBe("{on true, level 2}");
  expect(valueText(null)).toBe("–");
});

test("counts, shares, times", () => {
  expect(count(1823661)).toBe("1\u2009823\u2009661");
  expect([0.046, 0.47].map(percent)).toEqual(["4.6 %", "47 %"]);
  expect(seconds(1.5)).toBe("1.500 s");
});

test("what is read off has seven digits", () => {
  expect([1 / 3, 1234.56789, 12, 1e-5 / 3, 1234567890.5].map(reading)).toEqual([
    "0.3333333",
    "1234.568",
    "12",
    "3.333333e-6",
    "1.234568e+9",
  ]);
});

test("a time on the wall, which the virtual clock has none of", () => {
  const wall_ns = new Date(2026, 10, 29, 14, 3, 22).getTime() * 1e6;
  expect([clockText(wall_ns), dayText(wall_ns)]).toEqual(["14:03:22", "2026-11-29 14:03:22"]);
  expect([clockText(12e9), dayText(12e9)]).toEqual(["", ""]);
});
