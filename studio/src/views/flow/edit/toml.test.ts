// SPDX-License-Identifier: Apache-2.0
import { parse } from "smol-toml";
import { expect, test } from "vitest";
import { patched } from "./toml";

const TEXT = `# What smooths.
format = "opengpac-definitions"   # as gpac.load reads it

[graphs.smooth.blocks]
gain = { block = "library.gain", constants = { k = 2.0 } } # twice
filter = "library.lowpass"

[graphs.smooth.cells]
scaled = [
  "gain.y",   # from
  "filter.u",
]
"odd name" = 'x = "1" # no comment'
doc = """Two
lines = 3"""

[graphs.smooth.layout]
gain = {}
`;

type Tree = Record<string, never> & { graphs: { smooth: { blocks: Record<string, never>; cells: Record<string, never>; layout: object } } };

/** Applies a change to the contents of a TOML text; returns the new text and the lines that differ. */
function changed(change: (tree: Tree) => void, text = TEXT): { made: string; lines: [string | undefined, string | undefined][] } {
  const [before, after] = [parse(text), parse(text) as unknown as Tree];
  change(after);
  const made = patched(text, before, after);
  if (made === null) throw new Error("it was to be written anew");
  expect(parse(made)).toEqual(after);
  const [old, now] = [text.split("\n"), made.split("\n")];
  if (old.length !== now.length) return { made, lines: [] };
  return { made, lines: old.flatMap((line, at) => (line === now[at] ? [] : [[line, now[at]] as [string, string | undefined]])) };
}

test("a changed value changes its line only, and its comment stays", () => {
  const { lines } = changed((tree) => {
    Object.assign(tree.graphs.smooth.blocks.gain as never as { constants: object }, { constants: { k: 2.5 } });
  });
  expect(lines).toEqual([
    [
      'gain = { block = "library.gain", constants = { k = 2.0 } } # twice',
      'gain = { block = "library.gain", constants = { k = 2.5 } } # twice',
    ],
  ]);
});

test("texts with quotes, comments and lines in them are whole", () => {
  const { made } = changed((tree) => Object.assign(tree.graphs.smooth.cells, { "odd name": 'a "b" # c', doc: "one\ntwo" }));
  expect(made).toContain("# What smooths.\n");
  expect(made).toContain("# from");
});

test("a new key stands behind the last of its table, or in its inline table", () => {
  expect(changed((tree) => Object.assign(tree.graphs.smooth.blocks, { scale: "library.gain" })).made).toContain(
    'filter = "library.lowpass"\nscale = "library.gain"\n\n[graphs.smooth.cells]',
  );
  expect(changed((tree) => Object.assign(tree.graphs.smooth.layout, { gain: { x: 40, y: -2.5 } })).made).toContain(
    "gain = { x = 40, y = -2.5 }",
  );
});

test("a table that has no heading of its own gets one before the first table in it", () => {
  const { made } = changed((tree) => Object.assign(tree.graphs.smooth, { doc: "Smooths." }));
  expect(made).toContain('[graphs.smooth]\ndoc = "Smooths."\n\n[graphs.smooth.blocks]');
});

test("a key that is gone takes its line, or its comma", () => {
  expect(changed((tree) => Reflect.deleteProperty(tree.graphs.smooth.blocks, "filter")).made).not.toContain("library.lowpass");
  const { made } = changed((tree) => Reflect.deleteProperty(tree.graphs.smooth.blocks.gain as unknown as object, "block"));
  expect(made).toContain("gain = { constants = { k = 2.0 } } # twice");
});

test("random changes say what they are to say, and leave every comment", () => {
  let state = 16;
  const random = () => {
    state = (state * 1103515245 + 12345) % 2 ** 31;
    return state / 2 ** 31;
  };
  const value = () =>
    [random(), Math.floor(random() * 9), `t"${Math.floor(random() * 9)}'#`, [1.5, "a"], { a: true }][Math.floor(random() * 5)];
  let kept = 0;
  for (let round = 0; round < 120; round += 1) {
    const [before, after] = [parse(TEXT), parse(TEXT) as unknown as Tree];
    const tables = [after.graphs.smooth.blocks, after.graphs.smooth.cells, after.graphs.smooth.layout] as Record<string, unknown>[];
    for (let change = 0; change < 3; change += 1) {
      const table = tables[Math.floor(random() * 3)] as Record<string, unknown>;
      const keys = [...Object.keys(table), `new${change}`];
      const key = keys[Math.floor(random() * keys.length)] as string;
      if (random() < 0.3) Reflect.deleteProperty(table, key);
      else table[key] = value();
    }
    const made = patched(TEXT, before, after as never);
    if (made === null) continue;
    kept += 1;
    expect(parse(made)).toEqual(after);
    expect(made).toContain("# What smooths.");
  }
  expect(kept).toBeGreaterThan(105);
});

const TABLES = `# Goes and comes.
[verbs.v]
initial = "near"

[[verbs.v.transitions]]  # out
from = "near"
condition = "rose"   # it rose
to = "far"

[[verbs.v.transitions]]
from = "far"
condition = "fell"
to = "near"

[verbs.v.command_lists]
near = [
  { activate = "wave", every = "20 ms" },  # the wave
  { activate = "side", every = "20 ms" },  # its side
]
far = []
`;
type Verbs = { verbs: { v: { transitions: Record<string, string>[]; command_lists: { near: Record<string, string>[] } } } };

test("a value in an array of tables changes its line only; a table comes and goes with its heading", () => {
  const line = changed((tree) => Object.assign((tree as unknown as Verbs).verbs.v.transitions[0] as object, { to: "end" }), TABLES);
  expect(line.lines).toEqual([['to = "far"', 'to = "end"']]);
  const { made } = changed(
    (tree) => (tree as unknown as Verbs).verbs.v.transitions.push({ from: "near", condition: "lost", to: "far" }),
    TABLES,
  );
  expect(made).toContain(
    'to = "near"\n\n[[verbs.v.transitions]]\nfrom = "near"\ncondition = "lost"\nto = "far"\n\n[verbs.v.command_lists]',
  );
  const gone = changed((tree) => (tree as unknown as Verbs).verbs.v.transitions.splice(0, 1), TABLES).made;
  expect(gone).toContain('initial = "near"\n\n[[verbs.v.transitions]]\nfrom = "far"');
  expect(gone).not.toContain("it rose");
});

test("a value in the lines of an array changes its line only, and comments of the others stay", () => {
  const near = (tree: unknown) => (tree as Verbs).verbs.v.command_lists.near;
  const { lines } = changed((tree) => Object.assign(near(tree)[0] as object, { every: "10 ms" }), TABLES);
  expect(lines).toEqual([
    ['  { activate = "wave", every = "20 ms" },  # the wave', '  { activate = "wave", every = "10 ms" },  # the wave'],
  ]);
  const more = changed((tree) => near(tree).push({ execute: "x" }), TABLES).made;
  expect(more).toContain('  { activate = "side", every = "20 ms" },\n  { execute = "x" },  # its side\n]');
  const fewer = changed((tree) => near(tree).splice(0, 1), TABLES).made;
  expect(fewer).toContain('near = [\n  { activate = "side", every = "20 ms" },  # its side\n]');
});

test("what it does not know is written anew", () => {
  const text = "[[rows]]\na = 1\n";
  expect(patched(text, parse(text), { rows: 3 })).toBeNull();
});
