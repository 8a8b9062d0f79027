// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import {
  addBlock,
  addBoundary,
  allSets,
  connect,
  disconnect,
  removeBlock,
  renameBlock,
  renameSet,
  setDivide,
  setRequirement,
  setWith,
} from "./change";
import { type Draft, newGraph, newVerb } from "./definition";
import type { Face, Item } from "./faces";
import { renameRequirement } from "./rename";

function item(name: string, kind: Item["kind"]): Item {
  return { name, kind, mode: "synchronous", type_text: "double", unit: "", doc: "", has_default: false };
}

const face: Face = {
  name: "library.gain",
  doc: "y = k u",
  items: [item("u", "input"), item("y", "output"), item("k", "parameter")],
  types: {},
  file: "",
};
const faces = new Map([[face.name, face]]);
const gain = { block: { subroutine: "library.gain" }, constants: {} };
const here = { x: 0, y: 0 };

function with3(draft: Draft): Draft {
  return ["a", "b", "c"].reduce((before, name) => addBlock(before, gain, name, here).draft, draft);
}

const ports = (draft: Draft) => Object.fromEntries(allSets(draft).map((set) => [`${set.kind} ${set.name}`, set.ports]));

test("labels and sets get names of their own", () => {
  const first = addBlock(newGraph("g"), gain, "a", here).draft;
  const second = addBlock(first, gain, "a", { x: 5, y: 6 });
  expect(second.label).toBe("a2");
  expect(second.draft.of.layout.a2).toEqual({ x: 5, y: 6 });
  expect(first.of.blocks).not.toHaveProperty("a2");
});

test("a wire from a free output is a new cell, the next one joins it", () => {
  const one = connect(with3(newGraph("g")), "a.y", "b.u", faces);
  expect(ports(one)).toEqual({ "cells y": ["a.y", "b.u"] });
  const two = connect(one, "a.y", "c.u", faces);
  expect(ports(two)).toEqual({ "cells y": ["a.y", "b.u", "c.u"] });
  expect(connect(two, "a.y", "c.u", faces)).toBe(two);
});

test("an input has one writer: a second wire moves it, and an unread cell is gone", () => {
  const one = connect(with3(newGraph("g")), "a.y", "c.u", faces);
  const two = connect(one, "b.y", "c.u", faces);
  expect(setWith(two, "c.u")?.ports).toEqual(["b.y", "c.u"]);
  expect(ports(disconnect(two, "c.u", faces))).not.toHaveProperty("cells y2");
});

test("boundaries: an input feeds, an output takes over the cell that is written there", () => {
  let draft = addBoundary(addBoundary(with3(newGraph("g")), "inputs", "u", here), "outputs", "y", here);
  const boundary = (kind: string) => {
    const set = allSets(draft).find((one) => one.kind === kind);
    if (!set) throw new Error(`there is no ${kind}`);
    return set;
  };
  draft = connect(draft, boundary("inputs"), "a.u", faces);
  draft = connect(draft, "a.y", "b.u", faces);
  draft = connect(draft, "a.y", boundary("outputs"), faces);
  expect(ports(draft)).toEqual({ "inputs u": ["a.u"], "outputs y": ["a.y", "b.u"] });
  draft = connect(draft, "a.y", "c.u", faces);
  expect(ports(draft)["outputs y"]).toEqual(["a.y", "b.u", "c.u"]);
  expect(ports(renameSet(draft, "outputs", "y", "z"))).toHaveProperty("outputs z");
});

test("a port that goes from one output of the whole to another leaves the readers of the first", () => {
  let draft = ["y", "z"].reduce((before, name) => addBoundary(before, "outputs", name, here), with3(newGraph("g")));
  const output = (name: string) => ({ kind: "outputs" as const, name, ports: ports(draft)[`outputs ${name}`] ?? [] });
  draft = connect(draft, "a.y", output("y"), faces);
  draft = connect(draft, "a.y", "b.u", faces);
  draft = connect(draft, "a.y", output("z"), faces);
  expect(ports(draft)).toEqual({ "outputs y": ["b.u"], "outputs z": ["a.y"] });
  expect(ports(connect(draft, "a.y", output("z"), faces))).toEqual(ports(draft));
});

test("what names a block follows its label, and goes with it", () => {
  let draft = connect(with3(newVerb("v")), "a.y", "b.u", faces);
  if (draft.kind !== "verb") throw new Error("a verb is wanted");
  draft = {
    kind: "verb",
    of: {
      ...draft.of,
      command_lists: {
        start: {
          commands: [
            { command: "activate", block: "a", every_ns: 1e6 },
            { command: "wait", conditions: ["a.done"] },
          ],
        },
      },
      conditions: { done: { on: ["a.done"], returns: null, raises: false, during: [], priority: 0 } },
      output_values: { result: "a.y" },
      suspend: { holding: [{ set: "a.k", until: "a.done" }] },
    },
  };
  const renamed = renameBlock(draft, "a", "first");
  expect(JSON.stringify(renamed)).not.toMatch(/"a[."]/);
  expect(ports(renamed)).toEqual({ "cells y": ["first.y", "b.u"] });
  expect(renameBlock(draft, "a", "b")).toBe(draft);
  const gone = removeBlock(draft, "a");
  expect(JSON.stringify(gone)).not.toMatch(/"a[."]/);
});

test("a part of the rate of a graph goes with its block; requirements are set, renamed and removed", () => {
  const divided = setDivide(with3(newGraph("g")), "a", 5);
  const divide = (draft: Draft) => (draft.kind === "graph" ? draft.of.divide : undefined);
  expect(divide(renameBlock(divided, "a", "slow"))).toEqual({ slow: 5 });
  expect(divide(removeBlock(divided, "a"))).toEqual({});
  expect(divide(setDivide(divided, "a", undefined))).toEqual({});

  const required = setRequirement(newVerb("v"), "arm.homed", { raises: "NotHomed", when: "arm.needs_home" });
  if (required.kind !== "verb") throw new Error("a verb is wanted");
  const renamed = renameRequirement(required, "arm.homed", "arm.ready");
  expect(renamed.of.requires).toEqual({ "arm.ready": { raises: "NotHomed", when: "arm.needs_home" } });
  expect((setRequirement(renamed, "arm.ready", null) as typeof renamed).of.requires).toEqual({});
});
