// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { InstalledInstance, InstalledInstances, LogEntry, Statistics } from "../shapes";
import { byInstance, countUntil, installedAt } from "./state";

const entry = (sequence: number, time_s: number, kind: string, text = ""): LogEntry => ({
  sequence,
  time_s,
  kind,
  about: "sway#1",
  text,
  who: "",
});
const LOG = [
  entry(0, 1, "start"),
  entry(1, 2, "condition", "rose"),
  entry(2, 2, "transition", "command list 'far' after 'near'"),
  entry(3, 3, "transition", "command list 'near' after 'far'"),
  entry(4, 5, "end", "halted"),
  entry(5, 6, "start"),
];
const INSTANCE = { id: 7, name: "sway#1", state: "running", list: "far", initial: "near", starts: 9 } as InstalledInstance;
const told = [{ time_ns: 1.5e9, message: { instances: [INSTANCE] } as InstalledInstances }];

function at(time_s: number, now: Statistics | null = null) {
  return installedAt(told, byInstance(LOG), now, time_s * 1e9).instances.map(({ state, list, starts }) => [state, list, starts]);
}

test("lists and states are those that the log has until then", () => {
  expect(at(0.9)).toEqual([]);
  // The instance was reported only after it had started.
  expect(at(1)).toEqual([["running", "near", 1]]);
  expect(at(1.999999999)).toEqual([["running", "near", 1]]);
  expect(at(2)).toEqual([["running", "far", 1]]);
  expect(at(3)).toEqual([["running", "near", 1]]);
  expect(at(5)).toEqual([["ended", "near", 1]]);
  expect(at(6)).toEqual([["running", "near", 2]]);
});

test("what the log has no entry for, as being suspended, is known from the statistics", () => {
  const now = { now_s: 4, instances: [{ id: 7, state: "suspended" }] } as Statistics;
  expect(at(4.5, now)[0]).toEqual(["suspended", "near", 1]);
  expect(at(5.5, now)[0]).toEqual(["ended", "near", 1]);
});

test("an instance that is gone later is gone", () => {
  const gone = [...told, { time_ns: 8e9, message: { instances: [] } as unknown as InstalledInstances }];
  expect(installedAt(gone, byInstance(LOG), null, 9e9).instances).toEqual([]);
  expect(installedAt(gone, byInstance(LOG), null, 7e9).instances).toHaveLength(1);
});

test("entries until a time", () => {
  const times = [0.1, 0.2, 0.2, 0.3];
  expect([0, 1e8, 2e8, 2.5e8, 9e9].map((time) => countUntil(times, (one) => one, time))).toEqual([0, 1, 3, 3, 4]);
});
