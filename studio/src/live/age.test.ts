// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { ageText } from "./Age";
import { isStored } from "./stored";

test("ages are told in the unit that suits them", () => {
  expect([-0.1, 0.44, 12.4, 119, 180, 7200].map(ageText)).toEqual(["0.0 s", "0.4 s", "12 s", "119 s", "3 min", "2 h"]);
});

test("what a system is made with was never stored", () => {
  expect(isStored({ value: 0, number: 0, time_ns: 0 })).toBe(false);
  expect(isStored({ value: 0, number: 0, time_ns: 5 })).toBe(true);
  expect(isStored({ value: 0, number: 1, time_ns: 0 })).toBe(true);
});
