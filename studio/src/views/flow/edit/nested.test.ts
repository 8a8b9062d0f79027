// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { connect, removeSet, renameBlock, renameSet, setConstant } from "./change";
import type { Draft, Verb } from "./definition";
import { drawnDraft, isLost } from "./drawn";
import type { Face, Item } from "./faces";
import { findingsWithin, graphsWithin, ownGraph, replaced, standing, within } from "./nested";
import { removed } from "./places";
import { draftOf } from "./reading";

const item = (name: string, kind: Item["kind"]): Item => ({
  name,
  kind,
  mode: "synchronous",
  type_text: "double",
  unit: "rad",
  doc: "",
  has_default: false,
});
const gain: Face = {
  name: "library.gain",
  doc: "",
  items: [item("u", "input"), item("y", "output"), item("k", "parameter"), item("over", "condition")],
  types: {},
  file: "",
};
const faces = new Map([[gain.name, gain]]);

const smooth = {
  blocks: { f: "library.gain", g: "library.gain" },
  inputs: { u: "f.u" },
  outputs: { y: "g.y" },
  cells: { m: ["f.y", "g.u"] },
};
const outer = { blocks: { inner: "smooth" }, inputs: { u: "inner.u" }, outputs: { y: "inner.y" } };
const whole = draftOf(
  "verb",
  "v",
  {
    blocks: { one: "smooth", two: { block: "outer", constants: { "inner.f.k": 2 } }, last: "library.gain" },
    cells: { first: ["one.y", "two.u"], second: ["two.y", "last.u"] },
    conditions: { over: "one.f.over", also: "two.inner.f.over" },
    input_parameters: { k: ["one.f.k"] },
    modes: { "one.u": "asynchronous" },
    command_lists: { start: [{ activate: "one", every: "20 ms" }, { wait: "one.f.over" }] },
  },
  { smooth, outer },
);

const verb = (draft: Draft): Verb => {
  if (draft.kind !== "verb") throw new Error("it is a verb");
  return draft.of;
};
const changed = (way: string[], change: (draft: Draft) => Draft) => {
  const inner = within(whole, way);
  if (!inner) throw new Error(`nothing at ${way}`);
  return replaced(whole, way, change(inner));
};

test("a way leads into graphs, as far as there are some", () => {
  expect(within(whole, ["two", "inner"])?.of.name).toBe("smooth");
  expect(within(whole, ["last"])).toBeNull();
  expect(within(whole, ["constructor"])).toBeNull();
  expect(standing(whole, ["two", "inner", "f"])).toEqual(["two", "inner"]);
  expect(standing(whole, ["gone"])).toEqual([]);
  expect([...graphsWithin(whole).keys()]).toEqual(["smooth", "outer"]);
});

test("a change within is one of every use of the same graph, and of nothing else", () => {
  const next = changed(["one"], (inner) => setConstant(inner, "f", "k", 3));
  for (const way of [["one"], ["two", "inner"]]) expect(within(next, way)?.of.blocks.f?.constants).toEqual({ k: 3 });
  expect({ ...verb(next), blocks: {} }).toEqual({ ...verb(whole), blocks: {} });
  expect(replaced(whole, ["one"], within(whole, ["one"]) as Draft)).toEqual(whole);
});

test("a use with a graph of its own no longer follows", () => {
  const apart = ownGraph(whole, "one", "smooth2");
  const inner = within(apart, ["one"]) as Draft;
  const next = replaced(apart, ["one"], setConstant(inner, "f", "k", 3));
  expect(within(next, ["two", "inner"])?.of.blocks.f?.constants).toEqual({});
  expect(within(next, ["one"])?.of.name).toBe("smooth2");
});

test("another name for a port or a block within: what names it outside follows, at every depth", () => {
  const port = changed(["two", "inner"], (inner) => renameSet(inner, "outputs", "y", "z"));
  expect(verb(port).cells).toEqual({ first: ["one.z", "two.u"], second: ["two.y", "last.u"] });
  expect((within(port, ["two"]) as Draft & { kind: "graph" }).of.outputs).toEqual({ y: ["inner.z"] });
  const input = changed(["one"], (inner) => renameSet(inner, "inputs", "u", "in"));
  expect(verb(input).modes).toEqual({ "one.in": "asynchronous" });

  const block = verb(changed(["one"], (inner) => renameBlock(inner, "f", "first")));
  expect(block.conditions.over?.on).toEqual(["one.first.over"]);
  expect(block.conditions.also?.on).toEqual(["two.inner.first.over"]);
  expect(block.input_parameters.k?.targets).toEqual(["one.first.k"]);
  expect(block.command_lists.start?.commands[1]?.conditions).toEqual(["one.first.over"]);
  expect(block.blocks.two?.constants).toEqual({ "inner.first.k": 2 });
});

test("a port that disappears stays at the box, and is named at each wire", () => {
  const without = changed(["one"], (inner) => removeSet(inner, "outputs", "y"));
  const { boxes, wires } = drawnDraft(without, faces, [], null);
  const wire = wires.find((one) => one.cell === "first");
  expect(wire).toMatchObject({ from: { box: "one", port: "y" }, to: { box: "two", port: "u" } });
  expect(wire?.findings).toEqual(["'one' (graph smooth) has no port 'y'; remove the wire, or add the port to the graph again"]);
  expect(boxes.find((box) => box.id === "one")?.ports.map((port) => port.name)).toEqual(["u", "y"]);
  expect(boxes.find((box) => box.id === "one")?.findings.map((one) => one.port)).toEqual(["y"]);
  // The message of the system takes precedence.
  const said = { class: "UnknownName", message: "'one' (graph smooth) has no 'y'", remedy: "there are u", where: [{ cell: "first" }] };
  const told = drawnDraft(without, faces, [said], null).wires.find((one) => one.cell === "first");
  expect(told?.findings).toEqual(["'one' (graph smooth) has no 'y'; there are u"]);
  // Removing the last wire also removes the cell.
  expect(verb(removed(without, [], [wire?.id ?? ""], wires, faces)).cells).toEqual({ second: ["two.y", "last.u"] });
  // Items of nested blocks exist: `one.f.k`.
  expect([isLost(whole, "one.f.k", faces), isLost(whole, "two.inner.f.u", faces), isLost(whole, "one.f.kk", faces)]).toEqual([
    false,
    false,
    true,
  ]);
  // A missing port is drawn as an input if another port writes.
  const lost = changed(["one"], (inner) => removeSet(inner, "inputs", "u"));
  const fed = connect(lost, "last.y", "one.u", faces);
  expect(drawnDraft(fed, faces, [], null).wires.at(-1)).toMatchObject({ from: { box: "last" }, to: { box: "one", port: "u" } });
});

test("what is found within is named there as there, and stands at the box outside", () => {
  const found = [
    { class: "A", message: "in", where: [{ block: "two.inner.f", port: "u" }] },
    { class: "B", message: "own", where: [{ block: "two.inner", port: "u" }] },
    { class: "C", message: "cell", where: [{ cell: "two.inner.m" }] },
    { class: "D", message: "else", where: [{ block: "two" }, { cell: "first" }] },
  ];
  expect(findingsWithin(found, ["two", "inner"]).map(({ where }) => where)).toEqual([
    [{ block: "f", port: "u" }],
    [{ block: "", port: "u" }],
    [{ cell: "m" }],
  ]);
  const box = drawnDraft(whole, faces, found, null).boxes.find((one) => one.id === "two");
  expect(box?.findings.map((one) => one.text)).toEqual(["in", "own", "cell", "else"]);
});
