// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { own } from "../../../design/own";
import type { Box } from "../drawing/drawing";
import { grouped, regionAt } from "../drawing/regions";
import { addBlock, removeBlock, renameBlock } from "./change";
import { newGraph } from "./definition";
import { portOf } from "./drawn";
import { type History, stepped } from "./history";
import { followed, patternsOf, placedOn } from "./placement";
import { placesOf } from "./places";
import { draftOf } from "./reading";

const draft = draftOf("verb", "move", { blocks: { planner: "library.gain", servo: "library.gain" } });
const placement = { planner: "rtp0.slow", servo: "rtp0.fast" };

test("a placement follows a block's label, and goes with the block; undo brings both back", () => {
  expect(followed(placement, draft, renameBlock(draft, "servo", "pid"))).toEqual({ planner: "rtp0.slow", pid: "rtp0.fast" });
  expect(followed(placement, draft, removeBlock(draft, "planner"))).toEqual({ servo: "rtp0.fast" });
  expect(followed(placement, draft, draft)).toBe(placement);
  expect(placedOn(placedOn(placement, "servo", null), "planner", "rtp1.fast")).toEqual({ planner: "rtp1.fast" });
  expect(patternsOf(draft, placement)).toEqual({ "move.planner": "rtp0.slow", "move.servo": "rtp0.fast" });

  const begun: History = { past: [], present: { draft, file: null }, future: [] };
  const placed = stepped(begun, { on: placement });
  expect(placed.present.placement).toEqual(placement);
  expect(stepped(placed, { on: placement })).toBe(placed);
  const gone = stepped(placed, { to: removeBlock(draft, "servo") });
  expect(gone.present.placement).toEqual({ planner: "rtp0.slow" });
  expect(stepped(gone, { back: true }).present).toEqual(placed.present);
  expect(stepped(stepped(gone, { back: true }), { back: true }).present).toEqual(begun.present);
  expect(stepped(placed, { instead: { draft: newGraph("g"), file: null } }).present.placement).toBeUndefined();
});

test("each source has a column with its boxes, and a point lies in one", () => {
  const box = (id: string): Box => ({
    id,
    kind: "block",
    title: id,
    about: "",
    doc: "",
    ports: [],
    source: null,
    findings: [],
    opens: null,
  });
  const of = new Map([
    ["a", "rtp0.fast"],
    ["b", "rtp1.fast"],
  ]);
  const { regions, places } = grouped([box("a"), box("b"), box("c")], ["rtp0.fast", "rtp0.slow"], ({ id }) => of.get(id) ?? null, "free");
  expect(regions.map(({ title }) => title)).toEqual(["free", "rtp0.fast", "rtp0.slow", "rtp1.fast"]);
  for (const [id, source] of [
    ["a", "rtp0.fast"],
    ["b", "rtp1.fast"],
    ["c", null],
  ] as const)
    expect(regionAt(regions, places.get(id) ?? { x: -1, y: -1 })?.source).toBe(source);
  expect(regionAt(regions, { x: -5, y: 10 })).toBeUndefined();
});

test("a block may be called as what every object has: it is placed nowhere, and stands where there is room", () => {
  for (const label of ["__proto__", "constructor"]) {
    const { draft } = addBlock(newGraph("g"), { block: { subroutine: "library.gain" }, constants: {} }, label, { x: 7, y: 8 });
    expect(placesOf([{ id: label }], draft).get(label)).toEqual({ x: 7, y: 8 });
    expect(own({}, label)).toBeUndefined();
    expect(portOf(newGraph("g"), { box: label, port: "u" })).toBeUndefined();
    expect(portOf(draft, { box: label, port: "u" })).toBe(`${label}.u`);
  }
});
