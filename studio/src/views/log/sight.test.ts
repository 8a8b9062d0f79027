// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { broughtIntoSight, rowsInSight } from "./sight";

test("rows in sight and a few beyond are drawn", () => {
  expect(rowsInSight({ top: 0, height: 240 }, 1000, 24, 6)).toEqual([0, 16]);
  expect(rowsInSight({ top: 2400, height: 240 }, 1000, 24, 6)).toEqual([94, 116]);
  expect(rowsInSight({ top: 2400, height: 240 }, 105, 24, 6)).toEqual([94, 105]);
  expect(rowsInSight({ top: 2400, height: 240 }, 1000, 24, 1)).toEqual([99, 111]);
});

test("a row that is seen moves nothing; another one comes to the middle, or as near as there are rows", () => {
  const sight = { top: 240, height: 240 };
  expect(broughtIntoSight(sight, 10, 1000, 24)).toBe(sight);
  expect(broughtIntoSight(sight, 19, 1000, 24)).toBe(sight);
  expect(broughtIntoSight(sight, 20, 1000, 24)).toEqual({ top: 360, height: 240 });
  expect(broughtIntoSight(sight, 0, 1000, 24)).toEqual({ top: 0, height: 240 });
  expect(broughtIntoSight(sight, 999, 1000, 24)).toEqual({ top: 23760, height: 240 });
  expect(broughtIntoSight({ top: 0, height: 600 }, 2, 3, 24)).toEqual({ top: 0, height: 600 });
});
