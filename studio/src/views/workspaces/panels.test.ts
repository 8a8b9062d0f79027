// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { RefusalError } from "../../control/refusals";
import type { Button, End, InstalledInstance } from "../../control/shapes";
import type { Source } from "../../control/source";
import { StartedInstances } from "../../control/started";
import { beyond, limitsText } from "./limits";
import { instanceNameOf, start, stateOf } from "./starting";

test("a value beyond a limit is told in words with the limit and its unit", () => {
  const level = { name: "level", minimum: 0, maximum: 2 };
  expect(beyond(2.5, level, "m")).toBe("above 2\u202fm");
  expect(beyond(-1, level, "")).toBe("below 0");
  expect(beyond([0, 1, 3], level, "m")).toBe("above 2\u202fm");
  expect(beyond(2, level, "m")).toBeNull();
  expect(beyond(null, level, "m")).toBeNull();
  expect(beyond(99, { name: "level" }, "m")).toBeNull();
  expect([level, { name: "a", maximum: 2 }, { name: "a", minimum: 0.5 }, { name: "a" }].map(limitsText)).toEqual([
    "0 … 2",
    "at most 2",
    "at least 0.5000",
    "",
  ]);
});

const instance = (state: InstalledInstance["state"]) => ({ id: 7, name: "tank.Fill", state, list: "pour" }) as InstalledInstance;
const made: Button = { label: "Fill", start: { verb: "fill", values: { to: 2 } } as unknown as NonNullable<Button["start"]> };
const given: Button = { label: "Fill", instance: "fill#1", values: { to: 2 } };

test("a button stands for the instance of a program, or for its own, which every browser finds by its name", () => {
  expect(instanceNameOf(given, "tank")).toBe("fill#1");
  expect(instanceNameOf(made, "tank")).toBe("tank.Fill");
  expect(stateOf(made, null, []).text).toBe("ready");
  expect(stateOf(given, null, [])).toMatchObject({ text: "missing", isMissing: true });
  expect(stateOf(given, instance("running"), [])).toMatchObject({ text: "running: pour", isLive: true });
  const end = { number: 1, instance: 7, report: { condition: "fault", normal: false } } as End;
  expect(stateOf(given, instance("ended"), [end])).toMatchObject({ text: "ended: fault", tone: "bad", isLive: false });
});

/** Returns a mock system that logs its orders and refuses one call. */
function ordered(refused = "") {
  const asked: [string, unknown][] = [];
  const order = async (name: string, args: unknown) => {
    asked.push([name, args]);
    if (name === refused) throw new RefusalError([{ class: "NotEnabled", message: "not enabled" }], 409);
    return name === "create" ? 9 : null;
  };
  return { control: { order, pressed: () => 0, started: new StartedInstances() } as unknown as Source, asked };
}

test("a button starts the instance of a program with its values", async () => {
  const { control, asked } = ordered();
  await start(control, given, "tank", instance("created"));
  expect(asked).toEqual([["start", { instance: 7, values: { to: 2 } }]]);
  await expect(start(control, given, "tank", null)).rejects.toThrow("verb instance 'fill#1' does not exist");
});

test("what took too long to make for its press is kept, and the next press starts it", async () => {
  const { control, asked } = ordered("start");
  const times = [0, 1_200];
  control.pressed = () => times.shift() ?? 0;
  await expect(start(control, made, "tank", null)).rejects.toThrow("not enabled");
  expect(asked.map(([name]) => name)).toEqual(["create", "start"]);
  const next = ordered();
  next.control.started.make(7);
  await start(next.control, made, "tank", instance("created"));
  expect(next.asked).toEqual([["start", { instance: 7, values: { to: 2 } }]]);
});

test("an instance that another page has made is none of this one's to start unseen", async () => {
  const { control, asked } = ordered();
  await start(control, made, "tank", instance("created"));
  expect(asked.map(([name]) => name)).toEqual(["delete", "create", "start"]);
});

test("a button makes its instance anew, and leaves none behind that could not be started", async () => {
  const { control, asked } = ordered("start");
  await expect(start(control, made, "tank", instance("ended"))).rejects.toThrow("not enabled");
  expect(asked.map(([name]) => name)).toEqual(["delete", "create", "start", "delete"]);
  expect(asked[1]?.[1]).toEqual({ verb: "fill", name: "tank.Fill" });
  expect(asked[3]?.[1]).toEqual({ instance: 9 });
});
