// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { ArmDescription, ChainDescription, Report, TaughtPoint, TaughtPoints } from "../../control/shapes";
import { goalOf, motionTo, taughtAt, toldOfMotion } from "./points";
import { apart, numbersOf, poseOf, poseOfTurns, rollPitchYaw, toolPose, type Vector } from "./toolPose";

const STANDS = [0, 0, 0, 1, 0, 0, 0];
const [Y, Z] = [
  [0, 1, 0],
  [0, 0, 1],
];
const CHAIN: ChainDescription = {
  joints: 6,
  kind: [1, 1, 1, 1, 1, 1],
  base: STANDS,
  home: [0.9, 0.1, 0.2, Math.SQRT1_2, 0, Math.SQRT1_2, 0],
  tool: [0, 0, 0.1, 1, 0, 0, 0],
  axis: [Z, Y, Y, Y, Z, Y] as number[][],
  anchor: [
    [0, 0, 0.1],
    [0, 0, 0.1],
    [0.4, 0, 0.1],
    [0.8, 0, 0.1],
    [0.8, 0.1, 0.1],
    [0.9, 0.1, 0.1],
  ],
};
const ARM: ArmDescription = { name: "arm", joints: ["a", "b", "c", "d", "e", "f"], chain: CHAIN, missing: "" };
const Q = [0.3, -0.4, 0.5, 0.2, -0.6, 0.7];
const POINTS: TaughtPoints = {
  file: "points.toml",
  joints: ARM.joints,
  points: [],
  frames: [{ name: "table", position: [0.3, 0.1, 0.05], rpy_deg: [0, 0, 20] }],
  tools: [{ name: "gripper", position: [0, 0.02, 0.12], rpy_deg: [30, 0, 0] }],
};

const made = (frame: string, tool: string | null) => taughtAt(POINTS, CHAIN, Q, "pick", frame, tool) as TaughtPoint;

test.each([
  ["world", null],
  ["table", null],
  ["table", "gripper"],
] as const)("a point taught in %s with the tool %s is where it was taught, at the joints of the teaching", (frame, tool) => {
  const goal = goalOf(POINTS, made(frame, tool), CHAIN);
  expect(goal?.joints).toEqual(Q);
  const [distance, angle] = apart(toolPose(CHAIN, Q), goal?.pose ?? poseOf(STANDS));
  expect([distance < 1e-9, angle < 1e-9]).toEqual([true, true]);
});

test("a point moves with its frame, and holds for another tool of the arm; its joints are of the teaching no more", () => {
  const moved = { ...POINTS, frames: [{ name: "table", position: [0.3, 0.1, 0.15] as Vector, rpy_deg: [0, 0, 20] as Vector }] };
  const goal = goalOf(moved, made("table", null), CHAIN);
  const there = toolPose(CHAIN, Q).place;
  expect(goal?.pose.place[2]).toBeCloseTo(there[2] + 0.1, 9);
  expect(goal?.joints).toBe(null);
  const longer = { ...CHAIN, tool: [0, 0, 0.2, 1, 0, 0, 0] };
  expect(goalOf(POINTS, made("world", null), longer)?.joints).toBe(null);
  expect(goalOf({ ...POINTS, frames: [] }, made("table", null), CHAIN)).toBe(null);
  expect(goalOf({ ...POINTS, tools: [] }, made("table", "gripper"), CHAIN)).toBe(null);
});

test("joint positions go by joints; a line goes to the pose", () => {
  const point = taughtAt(POINTS, CHAIN, Q, "home", "joints", null) as TaughtPoint;
  expect(point).toEqual({ name: "home", joints: Q, note: "", frame: "joints" });
  const goal = goalOf(POINTS, { ...point, position: null } as TaughtPoint, CHAIN);
  if (!goal) throw new Error("it has a goal");
  expect(motionTo(goal, "joints", 30, CHAIN)).toEqual({ verb: "move_absolute", values: { goal: Q, speed: "30 %" } });
  const line = motionTo(goal, "line", 40, CHAIN);
  expect([line?.verb, line?.values.speed, line?.values.angular_speed]).toEqual(["move_linear", 0.1, 0.4]);
  expect(motionTo({ ...goal, joints: null }, "joints", 30, CHAIN)).toBe(null);
});

test("a pose as numbers is the same pose, whichever part of the quaternion is largest", () => {
  for (const turns of [
    [0.1, 0.2, 0.3],
    [3.1, 0.1, 0.2],
    [0.1, 3.1, -0.2],
    [0.2, 0.1, 3.1],
    [-2, 1, 2.5],
  ] as Vector[]) {
    const pose = poseOfTurns([1, 2, 3], turns);
    const numbers = numbersOf(pose);
    expect(Math.hypot(...numbers.slice(3))).toBeCloseTo(1, 12);
    expect(apart(pose, poseOf(numbers))[1]).toBeLessThan(1e-12);
    expect(apart(pose, poseOfTurns([1, 2, 3], rollPitchYaw(pose)))[1]).toBeLessThan(1e-12);
  }
});

test("the end of a motion is told where the arm is not there", () => {
  const ended = (condition: string, value: number | null = null) =>
    toldOfMotion(ARM, "pick", { condition, value, message: "the joint did not follow" } as Report)?.message ?? null;
  expect(ended("arrived")).toBe(null);
  expect(ended("stopped")).toMatch(/was stopped before its end/);
  expect(ended("unreachable")).toMatch(/cannot be reached in a line/);
  expect(ended("limit", 1)).toMatch(/joint 'b' would leave its range/);
  expect(ended("singular")).toMatch(/singularity/);
  expect(ended("following_error")).toBe("the joint did not follow");
});
