// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { addBlock, place, setText } from "./change";
import { newGraph, newVerb } from "./definition";
import { findingsOf } from "./findings";
import { type History, type Step, stepped } from "./history";
import { undoOf } from "./undoKeys";

const begun: History = { past: [], present: { draft: newGraph("g"), file: null }, future: [] };
const after = (...steps: Step[]) => steps.reduce(stepped, begun);

test("undo leads back exactly to where it began, and redo to where it ended", () => {
  const named = setText(begun.present.draft, { name: "h" });
  const { draft: filled } = addBlock(named, { block: { subroutine: "library.gain" }, constants: {} }, "gain", { x: 1, y: 2 });
  const done = after({ to: named }, { to: filled });
  expect(stepped(stepped(done, { back: true }), { back: true }).present).toEqual(begun.present);
  expect(after({ to: named }, { to: filled }, { back: true }, { back: true }, { again: true }, { again: true }).present).toEqual(
    done.present,
  );
});

test("a change that changes nothing is no step of undo", () => {
  const placed = place(begun.present.draft, "gain", { x: 1, y: 2 });
  const done = after({ to: placed }, { to: place(placed, "gain", { x: 1, y: 2 }) });
  expect(done.past).toHaveLength(1);
});

test("what another draft has taken the place of comes back", () => {
  const named = setText(begun.present.draft, { name: "mine" });
  const done = after({ to: named }, { instead: { draft: newVerb("untitled"), file: null } }, { back: true });
  expect(done.present.draft.of.name).toBe("mine");
});

test("a file goes with the draft that came from it", () => {
  const file = { name: "a.json", text: "{}" };
  const done = after({ instead: { draft: newGraph("a"), file } }, { to: newGraph("b") });
  expect(done.present.file).toBe(file);
  expect(stepped(stepped(done, { back: true }), { back: true }).present.file).toBeNull();
});

test("keys of undo and redo", () => {
  const key = (key: string, more = {}) => undoOf({ ctrlKey: true, metaKey: false, shiftKey: false, key, ...more });
  expect([key("z"), key("Z", { shiftKey: true }), key("y"), key("a"), key("z", { ctrlKey: false })]).toEqual([
    "back",
    "again",
    "again",
    null,
    null,
  ]);
});

test("a finding that names no place is about the whole", () => {
  expect(findingsOf([{ class: "DefinitionError", message: "no" }])).toEqual([{ class: "DefinitionError", message: "no", where: [] }]);
  expect(findingsOf(null)).toEqual([]);
});
