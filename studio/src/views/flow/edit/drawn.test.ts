// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { drawnDraft } from "./drawn";
import type { Face, Item } from "./faces";
import type { Finding } from "./findings";
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
const face = (name: string, items: Item[]): Face => ({ name, doc: "", items, types: {}, file: "" });
const faces = new Map([["library.gain", face("library.gain", [item("u", "input"), item("y", "output"), item("k", "parameter")])]]);
const draft = draftOf("graph", "g", {
  blocks: { a: "library.gain", b: "library.gain" },
  inputs: { u: "a.u" },
  outputs: { z: "b.y" },
  cells: { mid: ["a.y", "b.u"] },
});

const finding = (where: Finding["where"]): Finding => ({
  class: "TypeMismatch",
  message: "types differ",
  remedy: "declare one as the other",
  where,
});

test("blocks, boundaries and wires of a draft", () => {
  const { boxes, wires } = drawnDraft(draft, faces, [], null);
  expect(boxes.map((box) => [box.kind, box.title])).toEqual([
    ["block", "a"],
    ["block", "b"],
    ["boundary", "u"],
    ["boundary", "z"],
  ]);
  expect(wires.map((wire) => [wire.cell, wire.from.box, wire.to.box])).toEqual([
    ["u", "inputs:u", "a"],
    ["z", "b", "outputs:z"],
    ["mid", "a", "b"],
  ]);
  expect(boxes[0]?.ports.map((port) => port.name)).toEqual(["u", "y"]);
});

test("what is about two ports stands on their wire, what is about one at the port, what is about a box at the box", () => {
  const between = finding([
    { block: "a", port: "y" },
    { block: "b", port: "u" },
  ]);
  const onWire = drawnDraft(draft, faces, [between], null);
  expect(onWire.wires.find((wire) => wire.cell === "mid")?.findings).toEqual(["types differ; declare one as the other"]);
  expect(onWire.boxes.flatMap((box) => box.findings)).toEqual([]);
  const atPort = drawnDraft(draft, faces, [finding([{ block: "a", port: "u" }])], null);
  expect(atPort.boxes[0]?.findings[0]?.port).toBe("u");
  const atBox = drawnDraft(draft, faces, [finding([{ block: "b" }])], null);
  expect(atBox.boxes[1]?.findings[0]?.port).toBeNull();
  const ofCell = drawnDraft(draft, faces, [finding([{ cell: "mid" }])], null);
  expect(ofCell.wires.filter((wire) => wire.findings.length > 0).map((wire) => wire.cell)).toEqual(["mid"]);
});

test("a wire that was refused is drawn with its reason, and is part of nothing", () => {
  const refused = { from: { box: "a", port: "y" }, to: { box: "a", port: "u" }, reason: "a cycle of synchronous ports" };
  const { wires } = drawnDraft(draft, faces, [], refused);
  expect(wires.at(-1)).toMatchObject({ id: "refused", findings: ["a cycle of synchronous ports"] });
});
