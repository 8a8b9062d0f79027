// SPDX-License-Identifier: Apache-2.0
// A TOML text in which some values are others: only their lines change, and comments, order and spaces stay.
import { parse, stringify } from "smol-toml";
import { mapOf, pathKey, type Spot } from "./tomlText";

type Tree = Record<string, unknown>;

interface Edit {
  from: number;
  to: number;
  text: string;
}

/**
 * The text that says `after` where it said `before`: a value that is another is written in the place of the old one, a key that is gone
 * takes its line with it, a new one stands behind the last of its table. Null where that cannot be done so: then the whole is to be
 * written anew. What comes back has been read again, and says `after`.
 */
export function patched(text: string, before: Tree, after: Tree): string | null {
  const edits = editsOf(text, before, after);
  if (!edits) return null;
  const made = applied(text, edits);
  try {
    return same(parse(made), after) ? made : null;
  } catch {
    return null;
  }
}

/** The same with the keys of every table in one order: their order says nothing. */
export function same(one: unknown, other: unknown): boolean {
  return JSON.stringify(ordered(one)) === JSON.stringify(ordered(other));
}

function ordered(value: unknown): unknown {
  if (Array.isArray(value)) return value.map(ordered);
  if (typeof value === "bigint") return Number(value);
  if (!isTree(value)) return value;
  return Object.entries(value)
    .filter(([, of]) => of !== undefined)
    .sort(([a], [b]) => (a < b ? -1 : 1))
    .map(([key, of]) => [key, ordered(of)]);
}

function isTree(value: unknown): value is Tree {
  return typeof value === "object" && value !== null && !Array.isArray(value) && !(value instanceof Date);
}

function editsOf(text: string, before: Tree, after: Tree): Edit[] | null {
  const map = mapOf(text);
  if (!map) return null;
  const edits: Edit[] = [];
  const newline = text.includes("\r\n") ? "\r\n" : "\n";
  const compare = (path: readonly string[], old: Tree, wanted: Tree): boolean => {
    for (const key of new Set([...Object.keys(old), ...Object.keys(wanted)])) {
      const here = [...path, key];
      const [was, is] = [old[key], wanted[key]];
      if (same(was, is)) continue;
      const spot = map.spots.get(pathKey(here));
      if (isTree(was) && isTree(is)) {
        if (!compare(here, was, is)) return false;
      } else if (was !== undefined && is !== undefined) {
        if (!spot) return false;
        edits.push({ from: spot.from, to: spot.to, text: valueText(is) });
      } else if (is === undefined) {
        if (!spot) return false;
        edits.push(removed(text, spot));
      }
    }
    const fresh = Object.keys(wanted).filter((key) => old[key] === undefined && wanted[key] !== undefined);
    const added = addition(
      path,
      fresh.map((key) => `${keyText(key)} = ${valueText(wanted[key])}`),
      Object.keys(old).every((key) => wanted[key] === undefined),
    );
    if (added) edits.push(added);
    return added !== null || fresh.length === 0;
  };
  const addition = (path: readonly string[], lines: string[], isEmptied: boolean): Edit | null => {
    if (lines.length === 0) return null;
    const room = map.spots.get(pathKey(path))?.room;
    if (room) return { from: room.at, to: room.at, text: room.isEmpty || isEmptied ? ` ${lines.join(", ")} ` : `, ${lines.join(", ")}` };
    const section = map.sections.get(pathKey(path));
    if (!section) {
      // Only tables below it have a heading: it gets its own before the first of them.
      const below = [...map.sections.values()].filter((one) => path.every((key, index) => one.path[index] === key));
      const first = below.sort((one, other) => one.heading - other.heading)[0];
      if (!first || path.length === 0) return null;
      const put = [`[${path.map(keyText).join(".")}]`, ...lines, ""].map((line) => line + newline).join("");
      return { from: first.heading, to: first.heading, text: put };
    }
    const begins = section.at > 0 && text[section.at - 1] !== "\n" ? newline : "";
    return { from: section.at, to: section.at, text: begins + lines.map((line) => line + newline).join("") };
  };
  return compare([], before, after) ? edits : null;
}

/** A key goes with its line, or with its comma. */
function removed(text: string, spot: Spot): Edit {
  if (!spot.isInline) {
    const from = text.lastIndexOf("\n", spot.key_from - 1) + 1;
    const end = text.indexOf("\n", spot.to);
    return { from, to: end < 0 ? text.length : end + 1, text: "" };
  }
  const behind = /^\s*,\s*/.exec(text.slice(spot.to))?.[0];
  if (behind) return { from: spot.key_from, to: spot.to + behind.length, text: "" };
  const ahead = /\s*,\s*$/.exec(text.slice(0, spot.key_from))?.[0] ?? "";
  return { from: spot.key_from - ahead.length, to: spot.to, text: "" };
}

function applied(text: string, edits: readonly Edit[]): string {
  let made = text;
  // From the end: what stands before keeps its place. Of several at one place the first is written first.
  const order = edits.map((edit, index) => ({ ...edit, index })).sort((a, b) => b.from - a.from || b.index - a.index);
  for (const { from, to, text: put } of order) made = made.slice(0, from) + put + made.slice(to);
  return made;
}

function keyText(key: string): string {
  return /^[A-Za-z0-9_-]+$/.test(key) ? key : JSON.stringify(key);
}

/** A value on one line. */
function valueText(value: unknown): string {
  if (Array.isArray(value)) return `[${value.map(valueText).join(", ")}]`;
  if (isTree(value)) {
    const pairs = Object.entries(value).filter(([, of]) => of !== undefined);
    return pairs.length === 0 ? "{}" : `{ ${pairs.map(([key, of]) => `${keyText(key)} = ${valueText(of)}`).join(", ")} }`;
  }
  // `stringify` writes tables: the value is what follows the key.
  return stringify({ value })
    .replace(/^value = /, "")
    .trimEnd();
}
