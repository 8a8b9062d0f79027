// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { ChainDescription } from "../../control/shapes";
import { configurationOf } from "./configuration";

type Vector = [number, number, number];
const [X, Y, Z, BACK, BELOW]: Vector[] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
  [0, -1, 0],
  [0, 0, -1],
] as Vector[];
const STANDS = [0, 0, 0, 1, 0, 0, 0];

function chain(axis: (Vector | undefined)[], anchor: Vector[]): ChainDescription {
  return { joints: 6, kind: axis.map(() => 1), base: STANDS, home: STANDS, tool: STANDS, axis: axis as Vector[], anchor };
}

/** The UR5e of the library. */
const PARALLEL = chain(
  [Z, BACK, BACK, BACK, BELOW, BACK],
  [
    [0, 0, 0.1625],
    [0, 0, 0.1625],
    [-0.425, 0, 0.1625],
    [-0.8172, -0.1333, 0.1625],
    [-0.8172, -0.1333, 0.0628],
    [-0.8172, -0.2329, 0.0628],
  ],
);
const SPHERICAL = chain(
  [Z, Y, Y, X, Y, X],
  [
    [0, 0, 0.3],
    [0.1, 0, 0.4],
    [0.1, 0, 0.9],
    [0.3, 0, 1],
    [0.6, 0, 1],
    [0.7, 0, 1],
  ],
);

type Row = [number[], string, number[]];

// Joint positions, and the answer of `arm.configuration(q)` in Python: signs of shoulder, elbow and wrist, and turns.
test.each<Row>([
  [[-7.46, -4.74, 5.42, 1.48, -7.31, -1.2], "---", [-1, -1, 1, 0, -1, 0]],
  [[-1.25, 1.56, 4.28, 8.21, -3.88, 2.67], "--+", [0, 0, 1, 1, -1, 0]],
  [[3.53, -3.73, -8.97, 8.52, -3.63, -3.35], "+-+", [1, -1, -1, 1, -1, -1]],
  [[-2.26, -7.36, 2.89, 7.77, -5.27, 2.34], "-++", [0, -1, 0, 1, -1, 0]],
  [[-3.63, 4.35, 4.0, -5.06, 5.94, 2.84], "+--", [-1, 1, 1, -1, 1, 0]],
  [[6.68, -4.04, 1.11, -1.81, 2.03, -5.46], "+++", [1, -1, 0, 0, 0, -1]],
  [[8.37, 3.75, -5.15, 0.81, 3.71, -8.07], "++-", [1, 1, -1, 0, 1, -1]],
  [[9.0, -6.41, 0.67, 6.86, -8.05, 1.59], "-+-", [1, -1, 0, 1, -1, 0]],
])("the configuration of a UR5e at %j is %s", (q, configuration, turns) => {
  expect(configurationOf(PARALLEL, q)).toEqual({ configuration, turns });
});

test.each<Row>([
  [[3.05, 3.08, 0.15, -2.14, -4.46, -1.17], "+++", [0, 0, 0, 0, -1, 0]],
  [[-0.92, -4.55, -4.51, 4.99, 1.52, -2.65], "--+", [0, -1, -1, 1, 0, 0]],
  [[-0.65, 4.74, 3.98, 3.44, -1.08, -0.07], "+--", [0, 1, 1, 1, 0, 0]],
  [[1.77, -4.39, 0.56, -2.29, 3.8, -4.36], "-+-", [0, -1, 0, 0, 1, -1]],
  [[1.79, 3.7, -2.73, 3.95, 3.72, -4.81], "---", [0, 1, 0, 1, 1, -1]],
  [[-2.64, -1.8, 3.0, 0.07, 0.06, -2.64], "+-+", [0, 0, 0, 0, 0, 0]],
  [[-4.57, 0.3, -0.23, 3.33, -4.8, 0.57], "-++", [-1, 0, 0, 1, -1, 0]],
  [[1.15, -2.52, 0.53, 1.72, -3.09, 4.9], "++-", [0, 0, 0, 0, 0, 1]],
])("the configuration of an arm with a spherical wrist at %j is %s", (q, configuration, turns) => {
  expect(configurationOf(SPHERICAL, q)).toEqual({ configuration, turns });
});

test("a joint at half a turn is at turn 0, as in Python", () => {
  const halves = [1, -1, 3, -3, 5, -5].map((half) => half * Math.PI);
  expect(configurationOf(PARALLEL, halves)?.turns).toEqual([0, 0, 2, -2, 2, -2]);
});

test("joints that do not move the tool do not count, and other arms have no configurations", () => {
  const longer = {
    ...PARALLEL,
    joints: 7,
    kind: [0, ...PARALLEL.kind],
    axis: [[0, 0, 0], ...PARALLEL.axis],
    anchor: [[0, 0, 0], ...PARALLEL.anchor],
  };
  const q = [3.53, -3.73, -8.97, 8.52, -3.63, -3.35];
  expect(configurationOf(longer, [9, ...q])).toEqual(configurationOf(PARALLEL, q));
  expect(configurationOf({ ...PARALLEL, joints: 5 }, q)).toBe(null);
  expect(configurationOf({ ...PARALLEL, kind: [2, 1, 1, 1, 1, 1] }, q)).toBe(null);
  expect(configurationOf({ ...SPHERICAL, anchor: SPHERICAL.anchor.with(3, [0.3, 0.1, 1]) }, q)).toBe(null);
  expect(configurationOf(PARALLEL, [])).toBe(null);
});
