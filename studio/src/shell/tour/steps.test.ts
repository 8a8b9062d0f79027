// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Report, Statistics } from "../../control/shapes";
import { type Observation, stepsOf } from "./steps";

const [enable, jog, watch, move, stop] = stepsOf(["arm.elbow", "arm.wrist"]);

function seen(of: {
  devices?: Statistics["devices"];
  emergency?: string;
  ends?: [string, boolean][];
  view?: string;
  wasStopped?: boolean;
}): Observation {
  const now = { devices: of.devices ?? {}, emergency: of.emergency ?? null } as Statistics;
  const reports = (of.ends ?? []).map(([verb, normal]) => ({ verb, normal }) as Report);
  return { now, reports, view: of.view ?? "start", wasStopped: of.wasStopped ?? false };
}

test("there are five steps, and each but the last leads to its view", () => {
  expect(stepsOf(["arm.elbow"]).map((step) => step.link?.address ?? null)).toEqual([
    "#/devices/arm.elbow",
    "#/devices/arm.elbow",
    "#/scope?names=arm.elbow.sensed",
    "#/verbs/move_absolute",
    null,
  ]);
});

test("a step is done when its result is there", () => {
  expect(enable?.isDone(seen({ devices: { "arm.elbow": "standstill", "arm.wrist": "disabled" } }))).toBe(false);
  expect(enable?.isDone(seen({ devices: { "arm.elbow": "standstill", "arm.wrist": "moving" } }))).toBe(true);
  expect(jog?.isDone(seen({ ends: [["move_absolute", true]] }))).toBe(false);
  expect(jog?.isDone(seen({ ends: [["jog", false]] }))).toBe(true);
  expect(watch?.isDone(seen({ view: "devices" }))).toBe(false);
  expect(watch?.isDone(seen({ view: "scope" }))).toBe(true);
  expect(move?.isDone(seen({ ends: [["move_absolute", false]] }))).toBe(false);
  expect(move?.isDone(seen({ ends: [["move_absolute", true]] }))).toBe(true);
});

test("the last step is done after a stop and its reset, not before", () => {
  expect(stop?.isDone(seen({}))).toBe(false);
  expect(stop?.isDone(seen({ emergency: "pressed", wasStopped: true }))).toBe(false);
  expect(stop?.isDone(seen({ wasStopped: true }))).toBe(true);
});
