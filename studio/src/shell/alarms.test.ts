// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Alarm } from "../control/shapes";
import { foremost } from "./AlarmBar";
import { inOrder, MARKS, stateOf } from "./AlarmTable";
import { moving } from "./CommandHolder";

const alarm = (code: string, severity: Alarm["severity"], active: boolean, time_ns: number): Alarm => ({
  number: 1,
  code,
  source: "",
  block: null,
  text: "",
  remedy: "",
  severity,
  active,
  acknowledged: false,
  count: 1,
  time_ns,
  wall_ns: 0,
  returned_ns: null,
  acknowledged_ns: null,
  shelvable: true,
  shelvings: [],
});

test("the alarm that is told first: active, severe, new", () => {
  expect(foremost([])).toBeNull();
  const past = alarm("past", "critical", false, 9);
  const low = alarm("low", "low", true, 8);
  const [old, fresh] = [alarm("old", "high", true, 1), alarm("fresh", "high", true, 2)];
  expect(foremost([past, low, fresh, old])?.code).toBe("fresh");
  expect(foremost([past])?.code).toBe("past");
});

test("an alarm has one of three states, and what nobody has acknowledged comes first", () => {
  const acknowledged = { ...alarm("acknowledged", "critical", true, 5), acknowledged: true };
  const active = alarm("active", "low", true, 1);
  const returned = alarm("returned", "low", false, 2);
  expect([acknowledged, active, returned].map(stateOf)).toEqual(["acknowledged", "active", "returned"]);
  expect(inOrder([acknowledged, returned, active]).map((one) => one.code)).toEqual(["active", "returned", "acknowledged"]);
});

test("what moves although no session commands: running instances, not those that keep devices going", () => {
  const one = (name: string, state: "running" | "ended", owner: string | null) => ({
    id: 1,
    name,
    verb: "v",
    state,
    list: "",
    owner,
    running_s: 0,
  });
  const now = { instances: [one("sway#1", "running", null), one("servo#1", "running", "arm"), one("move#1", "ended", null)] };
  expect(moving(now as unknown as Parameters<typeof moving>[0])).toEqual(["sway#1"]);
  expect(moving(null)).toEqual([]);
});

test("each severity has a colour and a shape of its own", () => {
  const marks = Object.values(MARKS);
  expect([new Set(marks.map((mark) => mark.tone)).size, new Set(marks.map((mark) => mark.shape)).size]).toEqual([4, 4]);
});
