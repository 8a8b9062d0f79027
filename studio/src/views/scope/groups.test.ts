// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Configuration } from "../../control/shapes";
import { asDeclared, grouped, inside, NO_DEVICE } from "./groups";

const GROUPS = new Map([
  ["elbow.robot_joint:servo.error", inside("elbow.robot_joint")],
  ["rate", NO_DEVICE],
  ["wrist.sensed", "wrist"],
  ["wrist.velocity", "wrist"],
  ["elbow.sensed", "elbow"],
  ["belt.heartbeat", "belt"],
]);
const DEVICES = new Set(["elbow", "wrist"]);

test("the list begins with the devices, and ends with what blocks have inside", () => {
  expect(grouped([...GROUPS.keys()], GROUPS, false, DEVICES)).toEqual([
    { title: "elbow", names: ["elbow.sensed"] },
    { title: "wrist", names: ["wrist.sensed", "wrist.velocity"] },
    { title: "belt", names: ["belt.heartbeat"] },
    { title: NO_DEVICE, names: ["rate"] },
    { title: inside("elbow.robot_joint"), names: ["elbow.robot_joint:servo.error"] },
  ]);
});

test("the SVVs of a device are in the order of its type, the sensed position first", () => {
  const configuration = {
    logical_devices: { elbow: "robot_joint", wrist: "robot_joint" },
    device_types: { robot_joint: { svvs: { sensed: {}, velocity: {}, braking: {} } } },
  } as unknown as Configuration;
  const svvs = ["elbow.braking", "elbow.sensed", "elbow.velocity", "rate", "wrist.braking", "wrist.sensed"];
  expect(asDeclared(svvs, configuration)).toEqual([
    "elbow.sensed",
    "wrist.sensed",
    "elbow.velocity",
    "elbow.braking",
    "wrist.braking",
    "rate",
  ]);
  expect(asDeclared(svvs, null)).toEqual(svvs);
});

test("what is typed brings the best first, wherever it belongs", () => {
  expect(grouped(["elbow.robot_joint:servo.error", "elbow.sensed"], GROUPS, true, DEVICES).map((group) => group.title)).toEqual([
    inside("elbow.robot_joint"),
    "elbow",
  ]);
});
