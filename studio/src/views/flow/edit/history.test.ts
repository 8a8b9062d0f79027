// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import * as change from "./change";
import { addBlock, place, setText } from "./change";
import { type Draft, newGraph, newVerb } from "./definition";
import type { Face } from "./faces";
import { findingsOf } from "./findings";
import { type History, type Step, stepped } from "./history";
import { undoOf } from "./undoKeys";

const graph = newGraph("g");
const begun: History = { past: [], present: { draft: graph, file: null }, future: [] };
const after = (...steps: Step[]) => steps.reduce(stepped, begun);

test("undo leads back exactly to where it began, and redo to where it ended", () => {
  const named = setText(graph, { name: "h" });
  const { draft: filled } = addBlock(named, { block: { subroutine: "library.gain" }, constants: {} }, "gain", { x: 1, y: 2 });
  const done = after({ to: named }, { to: filled });
  expect(stepped(stepped(done, { back: true }), { back: true }).present).toEqual(begun.present);
  expect(after({ to: named }, { to: filled }, { back: true }, { back: true }, { again: true }, { again: true }).present).toEqual(
    done.present,
  );
});

test("a change that changes nothing is no step of undo", () => {
  const placed = place(graph, "gain", { x: 1, y: 2 });
  const done = after({ to: placed }, { to: place(placed, "gain", { x: 1, y: 2 }) });
  expect(done.past).toHaveLength(1);
});

test("what another draft has taken the place of comes back", () => {
  const named = setText(graph, { name: "mine" });
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

const face: Face = {
  name: "library.gain",
  doc: "",
  items: (["input u", "output y", "parameter k"] as const).map((said) => {
    const [kind, name] = said.split(" ") as ["input" | "output" | "parameter", string];
    return { name, kind, mode: "synchronous", type_text: "double", unit: "", doc: "", has_default: false };
  }),
  types: {},
  file: "",
};
const faces = new Map([[face.name, face]]);

/** Performs a random edit on a draft. */
function acted(draft: Draft, random: (below: number) => number): Draft {
  const labels = Object.keys(draft.of.blocks);
  const any = () => labels[random(labels.length)] ?? "none";
  const sets = change.allSets(draft);
  const set = sets[random(sets.length)];
  const at = { x: random(900), y: random(600) };
  const lists = draft.kind === "verb" ? Object.keys(draft.of.command_lists) : ["start"];
  const list = lists[random(lists.length)] ?? "start";
  const actions: (() => Draft)[] = [
    () => addBlock(draft, { block: { subroutine: "library.gain" }, constants: {} }, "gain", at).draft,
    () => change.removeBlock(draft, any()),
    () => change.renameBlock(draft, any(), `other${random(50)}`),
    () => place(draft, any(), at),
    () => change.connect(draft, `${any()}.y`, `${any()}.u`, faces),
    () => change.disconnect(draft, `${any()}.u`, faces),
    () => change.setConstant(draft, any(), "k", random(2) === 0 ? undefined : random(9)),
    () => change.addBoundary(draft, draft.kind === "graph" ? "outputs" : "instantiation_parameters", "end", at),
    () => (set ? change.removeSet(draft, set.kind, set.name) : draft),
    () => (set ? change.renameSet(draft, set.kind, set.name, `set${random(50)}`) : draft),
    () => change.setList(draft, `list${random(5)}`, [{ command: "activate", block: any(), every_ns: 1 + random(9) }]),
    () => change.removeList(draft, list),
    () => change.setInitial(draft, list),
    () => change.setCondition(draft, `c${random(4)}`, { on: [`${any()}.y`], returns: null, raises: false, during: [], priority: 0 }),
    () => change.setOutput(draft, `o${random(4)}`, random(2) === 0 ? null : `${any()}.y`),
    () => setText(draft, { name: `name${random(9)}` }),
  ];
  return (actions[random(actions.length)] as () => Draft)();
}

test.each([1, 2, 3, 4, 5])("2,000 random actions, seed %i: none fails, and undo leads back exactly to where each hundred began", (seed) => {
  let state = seed;
  const random = (below: number) => {
    state = (Math.imul(state, 1_664_525) + 1_013_904_223) >>> 0;
    return below === 0 ? 0 : Math.floor((state / 2 ** 32) * below);
  };
  let history: History = { past: [], present: { draft: seed % 2 === 0 ? newGraph("g") : newVerb("v"), file: null }, future: [] };
  for (let hundred = 0; hundred < 20; hundred += 1) {
    const before = JSON.stringify(history.present);
    history = { ...history, past: [] };
    for (let action = 0; action < 100; action += 1) history = stepped(history, { to: acted(history.present.draft as Draft, random) });
    const after = JSON.stringify(history.present);
    while (history.past.length > 0) history = stepped(history, { back: true });
    expect(JSON.stringify(history.present)).toBe(before);
    while (history.future.length > 0) history = stepped(history, { again: true });
    expect(JSON.stringify(history.present)).toBe(after);
  }
});
