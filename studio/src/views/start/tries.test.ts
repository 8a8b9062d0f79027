// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Configuration } from "../../control/shapes";
import { triesOf } from "./tries";

const EMPTY = { logical_devices: {}, device_types: {}, sources: {} } as unknown as Configuration;
const ARM = {
  logical_devices: { "ur5e.elbow": "robot_joint" },
  device_types: { robot_joint: { parameters: { jog_speed: {} } } },
  sources: { "rtp0.fast": {} },
} as unknown as Configuration;

test("what is offered can be done here", () => {
  const known = { verbs: [], svvs: [], mayOperate: true, mayConfigure: false };
  expect(triesOf({ ...known, configuration: EMPTY })).toEqual([]);
  const titles = (more: object) => triesOf({ ...known, configuration: ARM, ...more }).map((one) => one.title);
  const watching = ["View the machine", "Watch a value", "See what runs, and when"];
  expect(titles({ svvs: ["ur5e.elbow.sensed"] })).toEqual([...watching, "Record"]);
  expect(titles({ svvs: ["ur5e.elbow.sensed"], mayOperate: false })).toEqual(watching);
  const all = { verbs: ["jog", "jog_linear", "move_absolute"], svvs: ["studio.heartbeat", "ur5e.elbow.sensed"] };
  expect(titles({ ...all, mayConfigure: true })).toEqual([
    "Jog a joint",
    "Jog the tool of an arm",
    "Move to a position",
    "View the machine",
    "Watch a value",
    "See what runs, and when",
    "Record",
  ]);
  const cell = { ...ARM, logical_devices: { ...ARM.logical_devices, part: "digital_input" } } as unknown as Configuration;
  const force = (mayConfigure: boolean) =>
    triesOf({ ...known, ...all, mayConfigure, configuration: cell }).find((one) => one.title === "Force a signal");
  expect(force(true)?.address).toBe("#/devices/part");
  expect(force(false)).toBe(undefined);
  expect(titles({ ...all, mayOperate: false })[0]).toBe("View the machine");
  expect(triesOf({ ...known, ...all, configuration: ARM }).find((one) => one.title === "Watch a value")?.address).toBe(
    "#/scope?names=ur5e.elbow.sensed",
  );
});
