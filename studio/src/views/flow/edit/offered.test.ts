// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { foundChoices } from "../../../design/Choices";
import type { Draft } from "./definition";
import type { Face, Item } from "./faces";
import { fitting, offered, questionOf, tried, type WireStart, withOffered } from "./offered";
import { draftOf } from "./reading";

const item = (name: string, kind: Item["kind"], type_text = "double", unit = ""): Item => ({
  name,
  kind,
  mode: "synchronous",
  type_text,
  unit,
  doc: "",
  has_default: false,
});
const face = (name: string, items: Item[]): Face => ({ name, doc: "", items, types: {}, file: "" });
const faces = new Map(
  [
    face("library.gain", [item("u", "input"), item("y", "output")]),
    face("library.angle", [item("q", "input", "double", "rad"), item("q_out", "output", "double", "rad")]),
    face("library.not", [item("u", "input", "bool"), item("y", "output", "bool")]),
  ].map((one) => [one.name, one]),
);
const draft = draftOf("graph", "g", { blocks: { a: "library.angle", new: "library.gain" }, outputs: { z: "new.y", free: [] } });
const from: WireStart = { box: "a", port: "q_out", side: "output" };
const at = tried(draft, faces, []);
/** Answer of a system in which no port of `library.not` can be connected. */
const answered = Object.keys(at.draft.of.blocks).flatMap((block) =>
  ["u", "y", "q", "q_out"].map((port) => ({ block, port, reason: at.uses.get(block)?.name === "library.not" ? "types differ" : null })),
);

test("one of each block stands beside the draft to ask with, under labels that are free", () => {
  expect([...at.uses].map(([label, { name }]) => [label, name])).toEqual([
    ["new2", "library.gain"],
    ["new3", "library.angle"],
    ["new4", "library.not"],
  ]);
  expect(Object.keys(draft.of.blocks)).toEqual(["a", "new"]);
  expect(questionOf(draft, from, at)).toMatchObject({ from: { block: "a", port: "q_out" }, graph: { name: "g" } });
  expect(questionOf(draft, { box: "outputs:free", port: "value", side: "input" }, at)).toBeNull();
});

test("offered are ports that are there, blocks of the same unit before others, and the outside; never what does not fit", () => {
  const offers = offered(draft, from, at, answered, faces);
  expect(offers.map(({ text }) => text)).toEqual(["a.q", "new.u", "angle.q", "gain.u", "new output of the graph"]);
  expect(foundChoices("gain", offers).map(({ text }) => text)).toEqual(["gain.u"]);
  expect(foundChoices("", offers)).toHaveLength(5);
  // An unbound output of the graph accepts any writing port, of any type.
  const free = fitting(draft, { box: "outputs:free", port: "value", side: "input" }, at, faces);
  expect(free.map(({ port }) => port)).toEqual(["q_out", "y", "y", "q_out", "y"]);
});

test("what is chosen is there, and wired", () => {
  const choose = (text: string): { draft: Draft; box: string } => {
    const offer = offered(draft, from, at, answered, faces).find((one) => one.text === text);
    const made = offer && withOffered(draft, from, offer, { x: 1, y: 2 }, faces);
    if (!made) throw new Error(`nothing for ${text}`);
    return made;
  };
  const block = choose("gain.u");
  expect(block.box).toBe("gain");
  expect(block.draft.of.cells).toEqual({ q_out: ["a.q_out", "gain.u"] });
  expect(block.draft.of.layout.gain).toEqual({ x: 1, y: 2 });
  expect(choose("new.u").draft.of.cells).toEqual({ q_out: ["a.q_out", "new.u"] });
  const outside = choose("new output of the graph");
  expect(outside.box).toBe("outputs:q_out");
  expect((outside.draft as Draft & { kind: "graph" }).of.outputs).toMatchObject({ q_out: ["a.q_out"] });
});
