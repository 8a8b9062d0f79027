// SPDX-License-Identifier: Apache-2.0
import { parse, stringify } from "smol-toml";
import { expect, test } from "vitest";
import { place, setConstant } from "./change";
import type { Draft } from "./definition";
import { besides, draftsOf, fileText, savedFile } from "./file";
import { ownGraph, replaced, within } from "./nested";
import { draftOf, holdingOf, timeOrNull, withoutSources } from "./reading";

const short = {
  doc: "Moves.",
  blocks: { planner: "library.planner", near: { block: "library.near", constants: { k: 2 } }, inner: "smooth" },
  cells: { path: ["planner.path", "near.path"] },
  instantiation_parameters: { sensed: "near.sensed" },
  input_parameters: { goal: "planner.goal", speed: { targets: ["planner.speed"], default: 0.5, unit: "rad/s", form: "angle" } },
  command_lists: {
    start: [
      { execute: "planner" },
      { activate: "near", every: "20 ms", budget: "1 ms" },
      { wait: "near.done" },
      { wait: "0.5 s" },
      { wait: true },
    ],
  },
  conditions: { done: "near.done", lost: { on: ["near.lost"], raises: "Collision", during: "start" } },
  transitions: [{ from: "start", condition: "done", to: "start" }],
  layout: { planner: { x: 1, y: 2 }, wrong: { x: "a" } },
  if_cut_off: "halt",
  ending_limit: "2 s",
};
const smooth = { blocks: { f: "library.lowpass" }, inputs: { u: "f.u" }, outputs: { y: "f.y" } };

test("short forms become long ones, and nothing that is not known here is lost", () => {
  const draft = draftOf("verb", "move", short, { smooth });
  if (draft.kind !== "verb") throw new Error("a verb is wanted");
  const { of } = draft;
  expect(of.blocks.planner).toEqual({ block: { subroutine: "library.planner" }, constants: {} });
  expect(of.blocks.inner?.block).toMatchObject({ graph: { name: "smooth", inputs: { u: ["f.u"] } } });
  expect(of.command_lists.start?.commands).toEqual([
    { command: "execute", block: "planner" },
    { command: "activate", block: "near", every_ns: 20_000_000, budget_ns: 1_000_000 },
    { command: "wait", conditions: ["near.done"] },
    { command: "wait", time_ns: 500_000_000 },
    { command: "wait" },
  ]);
  expect(of.conditions.done?.on).toEqual(["near.done"]);
  expect(of.conditions.lost).toMatchObject({ raises: "Collision", during: ["start"] });
  expect(of.ending_limit_ns).toBe(2_000_000_000);
  expect(of.input_parameters.speed).toMatchObject({ form: "angle", default: 0.5 });
  expect(of.if_cut_off).toBe("halt");
  expect(of.layout).toEqual({ planner: { x: 1, y: 2 } });
});

test("a file that is written is read as the same draft", () => {
  const draft = draftOf("verb", "move", short, { smooth });
  expect(draftsOf(fileText(draft))).toEqual([draft]);
  const graph = draftOf("graph", "smooth", smooth);
  expect(draftsOf(fileText(graph))).toEqual([graph]);
});

test("a file may be TOML", () => {
  const json = { graphs: { smooth }, verbs: { move: short } };
  const toml = `format = "opengpac-definitions" # as gpac.load reads it
version = 1
${stringify(json)}`;
  expect(draftsOf(toml)).toEqual(draftsOf(JSON.stringify({ format: "opengpac-definitions", version: 1, ...json })));
});

test("what is not a file of definitions is refused in words", () => {
  expect(() => draftsOf('format = "opengpac-definitions"\n[graphs')).toThrow("neither JSON nor TOML: line 2");
  expect(() => draftsOf('{"format": ')).toThrow("the file is not valid JSON");
  expect(() => draftsOf('format = "opengpac-definitions"')).toThrow("version undefined");
  expect(() => draftsOf("{}")).toThrow("not a file of definitions");
  expect(() => draftsOf('{"format": "opengpac-definitions", "version": 2}')).toThrow("version 2");
  expect(() => draftOf("graph", "g", { blocks: { a: "none" } })).toThrow("this file has no graph 'none'");
  expect(() => draftOf("verb", "v", { command_lists: { start: [{ jump: "a" }] } })).toThrow("is not a command");
});

test("times are read with their units", () => {
  expect(timeOrNull("20 ms")).toBe(20_000_000);
  expect(timeOrNull("0.5s")).toBe(500_000_000);
  expect(timeOrNull("20")).toBeNull();
  expect(timeOrNull("near.done")).toBeNull();
});

const whole = `# Smoothing for the press.
format = "opengpac-definitions"
version = 1
description = "For the press."

[modules]
press = "press.c" # beside this file

[graphs.smooth]
blocks = { f = "library.lowpass" } # first order

[graphs.smooth.inputs]
u = "f.u"

[verbs.move.blocks]
inner = "smooth"

[verbs.move.command_lists]
start = [{ activate = "inner", every = "20 ms" }]

[compositions.both]
parts = { a = "move", b = "move" }
`;

test("a file that was not changed is saved as it was, byte for byte", () => {
  for (const draft of draftsOf(whole))
    expect(savedFile(draft, { name: "press.toml", text: whole })).toMatchObject({ name: "press.toml", text: whole });
  const json = JSON.stringify({ format: "opengpac-definitions", version: 1, verbs: { move: short }, graphs: { smooth } }, null, 7);
  for (const draft of draftsOf(json)) expect(savedFile(draft, { name: "a.json", text: json }).text).toBe(json);
});

test("a definition that was changed takes its place, and all else of the file stays", () => {
  const move = draftsOf(whole).find((one) => one.kind === "verb");
  if (move?.kind !== "verb") throw new Error("there is a verb");
  const changed = { ...move, of: { ...move.of, doc: "Moves." } };
  const saved = savedFile(changed, { name: "press.toml", text: whole });
  expect(saved).toMatchObject({ name: "press.toml", said: null });
  // One line and its heading are new; the others are unchanged.
  const fresh = saved.text.split("\n").filter((line) => !whole.split("\n").includes(line));
  expect(fresh).toEqual(["[verbs.move]", 'doc = "Moves."']);
  expect(draftsOf(saved.text).find((one) => one.kind === "verb")).toEqual(changed);
  // The same holds for JSON.
  const json = JSON.stringify(parse(whole));
  const tree = JSON.parse(savedFile(changed, { name: "press.json", text: json }).text);
  expect(tree).toMatchObject({
    description: "For the press.",
    modules: { press: "press.c" },
    compositions: { both: { parts: { a: "move" } } },
  });
  expect(tree.graphs.smooth.blocks).toEqual({ f: "library.lowpass" });
  expect(tree.verbs.move.doc).toBe("Moves.");
});

const written = `format = "opengpac-definitions"
version = 1
[verbs.move.blocks]
inner = "library.gain"
[verbs.move.command_lists]
start = [
  { activate = "inner", every = "20 ms" }, # the gain
  { execute = "inner" },
]
[[verbs.move.transitions]] # again
from = "start"
condition = "halted"
to = "start"
[[extra]]
a = 1
`;

test("what a TOML file says in arrays, of tables too, stays where it is, and so does what is not drawn here", () => {
  const [move] = draftsOf(written);
  if (move?.kind !== "verb") throw new Error("the verbs come first");
  const commands = [...(move.of.command_lists.start?.commands ?? []), { command: "execute" as const, block: "inner" }];
  const transitions = move.of.transitions.map((line) => ({ ...line, condition: "fault" }));
  const of = { ...move.of, command_lists: { start: { commands } }, transitions };
  const saved = savedFile({ kind: "verb", of }, { name: "press.toml", text: written });
  expect(saved.name).toBe("press.toml");
  expect(saved.text).toContain('  { activate = "inner", every = "20 ms" }, # the gain\n');
  expect(saved.text).toContain('[[verbs.move.transitions]] # again\nfrom = "start"\ncondition = "fault"\n');
  expect(saved.text).toContain("[[extra]]\na = 1\n");
});

test("TOML that cannot be changed in place becomes JSON, and says so", () => {
  const [move] = draftsOf(written);
  if (move?.kind !== "verb") throw new Error("the verbs come first");
  const saved = savedFile({ ...move, of: { ...move.of, transitions: [] } }, { name: "press.toml", text: written });
  expect(saved.name).toBe("press.json");
  expect(saved.said).toContain("without the comments, which remain in press.toml");
});

test("what is not drawn is told", () => {
  expect(besides(whole)).toBe("The file also has modules (press). They are not shown here, and are kept unchanged when the file is saved.");
  expect(besides('{"format": "opengpac-definitions", "version": 1}')).toBeNull();
});

test("a graph that the file names is changed where it is defined, and named as before", () => {
  const text = `format = "opengpac-definitions"
version = 1

[graphs.smooth]   # for all
blocks = { f = { block = "library.lowpass", constants = { alpha = 0.1 } } }
inputs = { u = "f.u" }
outputs = { y = "f.y" }

[graphs.twice.blocks]
one = "smooth"
two = "smooth"

[graphs.own.blocks]
inner = { block = { graph = { name = "mine", blocks = { f = "library.lowpass" } } } }
`;
  const file = { name: "g.toml", text };
  const drafts = draftsOf(text) as Draft[];
  const twice = drafts.find((one) => one.of.name === "twice") as Draft;
  const inner = within(twice, ["one"]) as Draft;
  const placed = replaced(twice, ["one"], place(inner, "f", { x: 1, y: 2 }));
  expect(savedFile(placed, file).text).toBe(text);
  const saved = savedFile(replaced(twice, ["one"], setConstant(inner, "f", "alpha", 0.5)), file);
  expect(saved.text).toBe(text.replace("alpha = 0.1", "alpha = 0.5"));
  expect(saved.said).toContain("graph 'smooth' was changed");
  // A use with its own graph no longer refers to the shared one: the graph is written inline.
  const apart = savedFile(ownGraph(twice, "one", "other"), file);
  const again = draftsOf(apart.text).find((one) => one.of.name === "twice") as Draft;
  expect(within(again, ["one"])?.of.name).toBe("other");
  expect(apart.text).toContain('two = "smooth"');
  // In JSON, a shared graph is also written by name, and an inline graph stays inline.
  const json = { name: "g.json", text: JSON.stringify(parse(text)) };
  const tree = JSON.parse(savedFile(replaced(twice, ["one"], setConstant(inner, "f", "alpha", 0.5)), json).text);
  expect(tree.graphs.twice.blocks.two.block).toEqual({ subroutine: "smooth" });
  expect(tree.graphs.smooth.blocks.f.constants).toEqual({ alpha: 0.5 });
  const own = drafts.find((one) => one.of.name === "own") as Draft;
  const changed = replaced(own, ["inner"], setConstant(within(own, ["inner"]) as Draft, "f", "alpha", 0.5));
  expect(JSON.parse(savedFile(changed, json).text).graphs.own.blocks.inner.block.graph.blocks.f.constants).toEqual({ alpha: 0.5 });
});

test("requirements, ways to come to rest, and places in programs", () => {
  const { of } = draftOf("verb", "v", {
    requires: { "arm.homed": "NotHomed", "arm.free": { raises: "InvalidState", when: "arm.used" } },
    suspend: { holding: [{ set: "a.hold", until: "a.held" }] },
  });
  expect(of.requires).toEqual({ "arm.homed": { raises: "NotHomed" }, "arm.free": { raises: "InvalidState", when: "arm.used" } });
  expect(holdingOf(of.suspend)).toEqual([{ set: "a.hold", until: "a.held" }]);
  expect(holdingOf("safe")).toBeNull();
  expect(withoutSources({ place: { targets: ["a.u"], place: { file: "x.py", line: 1 } }, list: [{ place: null, to: 1 }] })).toEqual({
    place: { targets: ["a.u"] },
    list: [{ to: 1 }],
  });
});
