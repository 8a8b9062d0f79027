// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { grouped, inside, NO_DEVICE } from "./groups";

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

test("what is typed brings the best first, wherever it belongs", () => {
  expect(grouped(["elbow.robot_joint:servo.error", "elbow.sensed"], GROUPS, true, DEVICES).map((group) => group.title)).toEqual([
    inside("elbow.robot_joint"),
    "elbow",
  ]);
});
