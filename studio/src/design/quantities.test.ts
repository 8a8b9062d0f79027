// SPDX-License-Identifier: Apache-2.0
// The cases are those of crates/model/src/quantity.rs: the page accepts exactly the same texts as the package.
import { expect, test } from "vitest";
import { commaIn, durationNs, numberIn } from "./quantities";

test.each([
  ["20 ms", "s", 0.02],
  ["90 deg", "rad", Math.PI / 2],
  ["0.5 rad/s", "rad/s", 0.5],
  ["10 N.m", "N*m", 10],
  ["30 %", "", 0.3],
  ["180deg/s^2", "rad/s2", Math.PI],
  ["1e-3 km", "m", 1],
  ["1.5", "rad", 1.5],
  ["7 counts", "counts", 7],
  ["5 mm", "rad|m", 0.005],
])("%s in %s is %d", (text, unit, number) => {
  expect(numberIn(text, unit).value).toBeCloseTo(number, 14);
});

test.each([
  ["20 ms", "rad", "the dimensions differ"],
  ["5 Hz", "rad/s", "the dimensions differ"],
  ["5 parsec", "m", "the unknown unit 'parsec'"],
  ["fast", "m", "is not a number with a unit"],
  ["", "m", "is not a number with a unit"],
  ["1,5 s", "s", "'1,5 s' has a decimal comma: write 1.5"],
  ["5 N", "rad|m", "the dimensions differ"],
])("%s in %s is refused: %s", (text, unit, why) => {
  expect(numberIn(text, unit).wrong).toContain(why);
});

test.each([
  ["20 ms", 20_000_000],
  ["0.1 s", 100_000_000],
  ["2 min", 120_000_000_000],
  ["250 us", 250_000],
  ["1 kHz", 1_000_000],
  ["1.5s", 1_500_000_000],
])("%s is a duration", (text, ns) => {
  expect(durationNs(text).value).toBe(ns);
});

test("a number of seconds counts where the field says so, and nowhere else", () => {
  expect(durationNs("1.5", "s").value).toBe(1_500_000_000);
  expect(durationNs("5").wrong).toContain("has no unit");
});

test.each(["-1 kHz", "5 m", "1e20 s", "soon", "1,5 s", "", "NaN", "Infinity s"])(
  "'%s' is no duration, and is refused with a sentence",
  (text) => {
    const { value, wrong } = durationNs(text, "s");
    expect(value).toBeUndefined();
    expect(wrong).toMatch(/ /);
  },
);

test("a list in brackets has commas of its own", () => {
  expect(commaIn("[1, 2]")).toBeNull();
  expect(commaIn("1,5")).toBe("'1,5' has a decimal comma: write 1.5");
});
