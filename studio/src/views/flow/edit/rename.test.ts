// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { removeBlock, renameBlock } from "./change";
import type { Draft } from "./definition";
import { draftOf } from "./reading";
import { renameCondition, renameList, renameObject, renameOutput } from "./rename";

const draft = draftOf("verb", "v", {
  blocks: { wave: "library.signal_generator", side: "library.comparator" },
  objects: { arm: "Joint", armour: "Joint" },
  modes: { "side.u": "asynchronous", "wave.phase": { ratio: 5 } },
  instantiation_parameters: { "arm.commanded": ["wave.y", "side.u"], "armour.sensed": ["side.reference"] },
  input_parameters: {
    place: { targets: "wave.offset", within: ["-arm.max_speed", "armour.max"], counted_from: "arm.commanded" },
    size: { targets: "wave.amplitude", within: [0, 1] },
  },
  requires: { "arm.homed": { raises: "NotHomed", when: "arm.needs_home" } },
  output_values: { level: "wave.y" },
  command_lists: { near: [{ activate: "wave", every: "20 ms" }], far: [{ wait: true }] },
  initial: "near",
  ending: "far",
  conditions: { rose: { on: "side.rose", during: "near", returns: ["level"] } },
  transitions: [{ from: "near", condition: "rose", to: "far" }],
  layout: { "list:near": { x: 1, y: 2 }, "instantiation_parameters:arm.commanded": { x: 3, y: 4 } },
}) as Draft & { kind: "verb" };

test("a condition is renamed in the transitions too, an output value in what conditions return", () => {
  const { conditions, transitions } = renameCondition(draft, "rose", "up").of;
  expect(Object.keys(conditions)).toEqual(["up"]);
  expect(transitions).toEqual([{ from: "near", condition: "up", to: "far" }]);
  expect(renameOutput(draft, "level", "height").of.conditions.rose?.returns).toEqual(["height"]);
});

test("a command list is renamed wherever it is named", () => {
  const of = renameList(renameList(draft, "near", "low"), "far", "high").of;
  expect(Object.keys(of.command_lists)).toEqual(["low", "high"]);
  expect([of.initial, of.ending, of.conditions.rose?.during]).toEqual(["low", "high", ["low"]]);
  expect(of.transitions).toEqual([{ from: "low", condition: "rose", to: "high" }]);
  expect(of.layout["list:low"]).toEqual({ x: 1, y: 2 });
});

test("an object is renamed with its members, and no other that begins like it", () => {
  const of = renameObject(draft, "arm", "robot").of;
  expect(Object.keys(of.objects ?? {})).toEqual(["robot", "armour"]);
  expect(Object.keys(of.instantiation_parameters)).toEqual(["robot.commanded", "armour.sensed"]);
  expect(of.input_parameters.place?.within).toEqual(["-robot.max_speed", "armour.max"]);
  expect(of.input_parameters.place?.counted_from).toBe("robot.commanded");
  expect(of.requires).toMatchObject({ "robot.homed": { when: "robot.needs_home" } });
  expect(of.layout["instantiation_parameters:robot.commanded"]).toEqual({ x: 3, y: 4 });
});

test("modes follow their block, and go with it", () => {
  expect(renameBlock(draft, "side", "edge").of.modes).toEqual({ "edge.u": "asynchronous", "wave.phase": { ratio: 5 } });
  expect(removeBlock(draft, "wave").of.modes).toEqual({ "side.u": "asynchronous" });
});
