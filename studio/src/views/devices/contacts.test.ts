// SPDX-License-Identifier: Apache-2.0
import { Color } from "three";
import { expect, test } from "vitest";
import { arrowsOf, CHOSEN_M, ContactArrows } from "./contacts";

const NONE = [0, 0, 0, 0, 0, 0];

test("an arrow starts at its contact and is as long as its force", () => {
  const [first, second, ...more] = arrowsOf([0.1, 0.2, 0, 0, 0, 20, ...NONE, 1, 2, 3, -5, 0, 0, ...NONE], 10);
  expect(more).toEqual([]);
  expect(first?.from.toArray()).toEqual([0.1, 0.2, 0]);
  expect(first?.along.toArray()).toEqual([0, 0, 1]);
  expect(first?.length_m).toBeCloseTo(2 * CHOSEN_M, 12);
  expect(second?.along.x).toBe(-1);
  expect(second?.length_m).toBeCloseTo(CHOSEN_M / 2, 12);
});

test("what is told in part, or is no number, is not drawn", () => {
  expect(arrowsOf([1, 2, 3, 4, 5], 1)).toEqual([]);
  expect(arrowsOf([1, 2, 3, Number.NaN, 0, 0], 1)).toEqual([]);
});

test("arrows that are not needed any more are hidden and come back", () => {
  const arrows = new ContactArrows(1, new Color());
  const seen = () => arrows.root.children.map((child) => child.visible);
  expect(arrows.put([0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 2, 0])).toBe(2);
  expect(seen()).toEqual([true, true]);
  expect(arrows.put([0, 0, 0, 1, 0, 0, ...NONE])).toBe(1);
  expect(seen()).toEqual([true, false]);
  expect(arrows.put([])).toBe(0);
  expect(arrows.put([0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 2, 0])).toBe(2);
  expect(seen()).toEqual([true, true]);
  arrows.dispose();
});
