// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { copied, pasted, pieceOf, textOf } from "./clipboard";
import { newGraph } from "./definition";
import { draftOf } from "./reading";

const draft = draftOf("graph", "g", {
  blocks: { a: { block: "library.gain", constants: { k: 3 } }, b: "library.gain", c: "library.gain" },
  cells: { mid: ["a.y", "b.u"], end: ["b.y", "c.u"] },
  modes: { "b.u": "asynchronous", "c.u": { ratio: 2 } },
  layout: { a: { x: 10, y: 20 } },
});

test("blocks are copied with their constants, modes and the cells between them", () => {
  const piece = copied(draft, ["a", "b"]);
  expect(piece.cells).toEqual({ mid: ["a.y", "b.u"] });
  expect(piece.modes).toEqual({ "b.u": "asynchronous" });
  const made = pasted(draft, piece);
  expect(made.labels).toEqual(["a2", "b2"]);
  expect(made.draft.of.blocks.a2).toEqual(draft.of.blocks.a);
  expect(made.draft.of.cells).toEqual({ ...draft.of.cells, mid2: ["a2.y", "b2.u"] });
  expect(made.draft.of.modes).toEqual({ ...draft.of.modes, "b2.u": "asynchronous" });
  expect(made.draft.of.layout.a2).toEqual({ x: 50, y: 60 });
});

test("into another draft they keep their names, by way of a text that no other text is taken for", () => {
  const piece = pieceOf(textOf(copied(draft, ["a", "b"])));
  if (!piece) throw new Error("it is a piece");
  expect(pasted(newGraph("other"), piece).labels).toEqual(["a", "b"]);
  expect(pieceOf("anything")).toBeNull();
  expect(pieceOf('{"opengpac-blocks": broken')).toBeNull();
});
