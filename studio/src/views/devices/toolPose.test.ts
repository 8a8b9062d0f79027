// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { ArmDescription, ChainDescription, Report } from "../../control/shapes";
import { toldOfEnd, toolMotion, whyNot } from "./toolJog";
import { movingJoints, poseOf, rollPitchYaw, toolPose } from "./toolPose";

const STANDS = [0, 0, 0, 1, 0, 0, 0];

/** Geometry of the package's UR5e with a rotated tool, as returned by `arm.chain`. */
const UR5E: ChainDescription = {
  joints: 6,
  kind: [1, 1, 1, 1, 1, 1],
  base: STANDS,
  home: [-0.8172, -0.2329, 0.0628, Math.SQRT1_2, Math.SQRT1_2, 0, 0],
  tool: [0.01, 0.02, 0.12, 0.9961946980917455, 0.08715574274765817, 0, 0],
  axis: [
    [0, 0, 1],
    [0, -1, 0],
    [0, -1, 0],
    [0, -1, 0],
    [0, 0, -1],
    [0, -1, 0],
  ],
  anchor: [
    [0, 0, 0.1625],
    [0, 0, 0.1625],
    [-0.425, 0, 0.1625],
    [-0.8172, -0.1333, 0.1625],
    [-0.8172, -0.1333, 0.0628],
    [-0.8172, -0.2329, 0.0628],
  ],
};
const ARM: ArmDescription = { name: "ur5e", joints: ["a", "b", "c", "d", "e", "f"], chain: UR5E, missing: "" };

function close(found: readonly number[], wanted: readonly number[]): void {
  expect(found.length).toBe(wanted.length);
  for (const [index, value] of wanted.entries()) expect(found[index]).toBeCloseTo(value, 9);
}

test("the tool stands where the block forward_kinematics has it", () => {
  // Result of the package's `arm.forward(q)` for these joints.
  const pose = toolPose(UR5E, [0.3, -1.2, 1.4, -1.8, -1.5, 0.2]);
  close(pose.place, [-0.5527857513249698, -0.3207043494041576, 0.2636108058525193]);
  close(rollPitchYaw(pose), [-2.952447791713231, 0.0751694259170138, 1.6723800425477078]);
});

test("a joint that slides moves the tool along its axis, and a finger does not move it", () => {
  const lift: ChainDescription = {
    ...UR5E,
    joints: 2,
    kind: [2, 0],
    base: [1, 0, 0, Math.SQRT1_2, 0, 0, Math.SQRT1_2],
    home: STANDS,
    tool: STANDS,
    axis: [
      [1, 0, 0],
      [0, 0, 0],
    ],
  };
  close(toolPose(lift, [0.5, 7]).place, [1, 0.5, 0]);
  expect(movingJoints(lift)).toBe(1);
});

test("at a pitch of 90 degrees all of the turn is roll", () => {
  const [roll, pitch, yaw] = rollPitchYaw(poseOf([0, 0, 0, Math.SQRT1_2, 0, Math.SQRT1_2, 0]));
  close([roll, pitch, yaw], [0, Math.PI / 2, 0]);
});

test("a press asks for one axis, in the unit of the verb", () => {
  const along = toolMotion(ARM, UR5E, { axis: "Z", direction: -1, share: 20, inTool: false, step: 0 });
  expect(along.values).toMatchObject({ velocity: [0, 0, -0.05], angular_velocity: [0, 0, 0], in_tool: false, distance: 0 });
  expect([along.isStep, along.devices]).toEqual([false, ARM.joints]);
  const about = toolMotion(ARM, UR5E, { axis: "RX", direction: 1, share: 100, inTool: true, step: 10 });
  expect(about.values).toMatchObject({ velocity: [0, 0, 0], angular_velocity: [1, 0, 0], in_tool: true, distance: Math.PI / 18 });
  expect(about.isStep).toBe(true);
});

test("an arm that cannot be jogged by its tool says why", () => {
  expect(whyNot(ARM)).toBe(null);
  expect(whyNot({ ...ARM, chain: null, missing: "it has no model" })).toMatch(/is unknown: it has no model/);
  expect(whyNot({ ...ARM, chain: { ...UR5E, kind: [1, 1, 0, 0, 0, 0] } })).toMatch(/2 joints that move its tool/);
  expect(whyNot({ ...ARM, chain: { ...UR5E, kind: [1, 0, 0, 0, 0, 0] } })).toMatch(/1 joint that moves its tool/);
});

test("the end of a motion is told in words where a person has to know it", () => {
  const ended = (condition: string, value: number | null = null) =>
    toldOfEnd(ARM, { condition, value, message: "the joint did not follow" } as Report)?.message ?? null;
  expect(ended("arrived")).toBe(null);
  expect(ended("blocked", 2)).toMatch(/joint 'c' is at the end of its range/);
  expect(ended("blocked", -1)).toMatch(/singularity/);
  expect(ended("stopped")).toMatch(/received nothing from this page/);
  expect(ended("following_error")).toBe("the joint did not follow");
});
