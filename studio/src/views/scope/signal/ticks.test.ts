// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { ticks } from "./ticks";

test("marks are round, in the range, and about as many as asked for", () => {
  expect(ticks(0, 1, 5)).toEqual([0, 0.2, 0.4, 0.6, 0.8, 1]);
  expect(ticks(-0.31, 0.29, 4)).toEqual([-0.2, 0, 0.2]);
  expect(ticks(12.3, 12.31, 5)).toEqual([12.3, 12.302, 12.304, 12.306, 12.308, 12.31]);
  expect(ticks(1234.5678, 1234.5682, 9)).toHaveLength(9);
  expect(ticks(1, 1, 5)).toEqual([]);
  expect(ticks(Number.NaN, 1, 5)).toEqual([]);
});
