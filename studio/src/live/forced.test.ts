// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Statistics } from "../control/shapes";
import { forcedOf, forceOf } from "./forced";

const NOW = {
  forced: {
    part: { number: 1, channel: "io.part_present", output: false, value: true, who: "anna", since_s: 1 },
    valve: { number: 2, channel: "io.valve", output: true, value: 0.5, who: "bert", since_s: 2 },
  },
} as unknown as Statistics;

test("the value of a forced signal and its channel are marked, and nothing else", () => {
  expect(forceOf(NOW, "part.value")).toBe("input forced to true by anna");
  expect(forceOf(NOW, "io.part_present")).toBe("input forced to true by anna");
  expect(forceOf(NOW, "valve.value")).toBe("output forced to 0.5000 by bert");
  for (const name of ["part", "part.values", "io.part", "valve.commanded"]) expect(forceOf(NOW, name)).toBe(null);
});

test("a system that has said nothing yet, and a recording of an earlier release, have no forced signals", () => {
  expect(forcedOf(null)).toEqual({});
  expect(forceOf({} as Statistics, "part.value")).toBe(null);
});
