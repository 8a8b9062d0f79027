// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { arrowsOf, shapeOfDefinition } from "./shape";
import { layOut, pathThrough } from "./states";

const defined = {
  name: "move",
  command_lists: {
    start: {
      commands: [
        { command: "execute", block: "planner" },
        { command: "activate", block: "generator", every_ns: 20_000_000 },
      ],
    },
    stop: { commands: [{ command: "wait", conditions: ["brake.stopped"], time_ns: 500_000_000 }] },
  },
  initial: null,
  conditions: { arrived: { on: ["near.done"], during: "start" }, force: { on: ["guard.above"], raises: true }, halted: { on: [] } },
  transitions: [{ from: "start", condition: "halted", to: "stop" }],
};

test("a definition becomes lists of commands in words", () => {
  const shape = shapeOfDefinition(defined);
  expect(shape?.initial).toBe("start");
  expect(shape?.lists[0]?.commands).toEqual(["execute planner", "activate generator every 20 ms"]);
  expect(shape?.lists[1]?.commands).toEqual(["wait for brake.stopped"]);
  expect(shapeOfDefinition({ name: "nothing" })).toBeNull();
});

test("arrows: transitions, and what ends the verb in each list", () => {
  const shape = shapeOfDefinition(defined);
  if (!shape) throw new Error("it has a shape");
  const arrows = arrowsOf(shape).map((arrow) => [arrow.from, arrow.to, arrow.conditions.map((one) => one.name)]);
  expect(arrows).toEqual([
    ["start", "stop", ["halted"]],
    ["start", null, ["arrived", "force"]],
    ["stop", null, ["force"]],
  ]);
});

test("every list has a box, every arrow a path", async () => {
  const shape = shapeOfDefinition(defined);
  if (!shape) throw new Error("it has a shape");
  const laid = await layOut(shape);
  expect(laid.boxes.map((box) => box.name).sort()).toEqual(["(end)", "(start)", "start", "stop"]);
  expect(laid.arrows).toHaveLength(4);
  for (const { path } of laid.arrows) expect(path).toMatch(/^M[\d.]+ [\d.]+L/);
});

test("corners are rounded", () => {
  expect(
    pathThrough([
      { x: 0, y: 0 },
      { x: 0, y: 20 },
      { x: 20, y: 20 },
    ]),
  ).toBe("M0 0L0 14Q0 20 6 20L20 20");
});
