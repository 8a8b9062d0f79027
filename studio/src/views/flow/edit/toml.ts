// SPDX-License-Identifier: Apache-2.0
// Changes some values of a TOML text: only their lines change; comments, order and spaces are kept.
import { parse, stringify } from "smol-toml";
import { type Map_, mapOf, pathKey, type Spot } from "./tomlText";

type Tree = Record<string, unknown>;

interface Edit {
  from: number;
  to: number;
  text: string;
}

/**
 * Returns the text with its contents changed from `before` to `after`: changed values are replaced in place, removed keys are deleted
 * with their lines, and new keys are added at the end of their tables. Returns null if that is impossible, so that the whole text must
 * be rewritten. The result is parsed again to verify that it contains `after`.
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

/** Returns whether two values are equal, regardless of the order of keys. */
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
      } else if (map.arrays.has(pathKey(here)) && Array.isArray(was) && Array.isArray(is)) {
        const found = tablesEdits(text, map, here, was, is, compare);
        if (!found) return false;
        edits.push(...found);
      } else if (spot && Array.isArray(was) && Array.isArray(is) && was.length > 0 && is.length > 0) {
        if (!compareLists(here, was, is)) return false;
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
  /** Compares the values of two arrays; equal values at the beginning and end remain unchanged. */
  const compareLists = (path: readonly string[], was: unknown[], is: unknown[]): boolean => {
    const { first, old, wanted } = middleOf(was, is);
    const at = (index: number) => map.spots.get(pathKey([...path, String(index)]));
    for (const [index, value] of wanted.entries()) {
      const [before, spot] = [old[index], at(first + index)];
      if (index >= old.length) break;
      if (!spot) return false;
      if (same(before, value)) continue;
      if (isTree(before) && isTree(value)) {
        if (!compare([...path, String(first + index)], before, value)) return false;
      } else if (Array.isArray(before) && Array.isArray(value) && before.length > 0 && value.length > 0) {
        if (!compareLists([...path, String(first + index)], before, value)) return false;
      } else edits.push({ from: spot.from, to: spot.to, text: valueText(value) });
    }
    for (let index = wanted.length; index < old.length; index += 1) {
      const spot = at(first + index);
      if (!spot) return false;
      edits.push(removedValue(text, spot));
    }
    const more = wanted.slice(old.length).map(valueText);
    if (more.length === 0) return true;
    const [before, behind] = [at(first + old.length - 1), at(first + old.length)];
    // If the values of an array are on separate lines, a new one gets its own line with the same indentation.
    if (before) {
      const own = /(\r?\n[ \t]*)$/.exec(text.slice(0, before.from))?.[1] ?? " ";
      edits.push({ from: before.to, to: before.to, text: more.map((value) => `,${own}${value}`).join("") });
    } else if (behind) {
      const own = /(\r?\n[ \t]*)$/.exec(text.slice(0, behind.from))?.[1] ?? " ";
      edits.push({ from: behind.from, to: behind.from, text: more.map((value) => `${value},${own}`).join("") });
    } else return false;
    return true;
  };
  const addition = (path: readonly string[], lines: string[], isEmptied: boolean): Edit | null => {
    if (lines.length === 0) return null;
    const room = map.spots.get(pathKey(path))?.room;
    if (room) return { from: room.at, to: room.at, text: room.isEmpty || isEmptied ? ` ${lines.join(", ")} ` : `, ${lines.join(", ")}` };
    const section = map.sections.get(pathKey(path));
    if (!section) {
      // Only subtables have a heading: the table gets its own before the first of them.
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

type Compare = (path: readonly string[], old: Tree, wanted: Tree) => boolean;

/**
 * Returns the edits for an array of tables. Equal tables at its beginning and end remain unchanged; the others are compared in order,
 * surplus tables are deleted with their headers, and missing ones are added. Returns null if that is impossible.
 */
function tablesEdits(text: string, map: Map_, path: readonly string[], was: unknown[], is: unknown[], compare: Compare): Edit[] | null {
  const heading = map.arrays.get(pathKey(path))?.heading;
  if (heading === undefined || !was.every(isTree) || !is.every(isTree) || is.length === 0) return null;
  const edits: Edit[] = [];
  const { first, old, wanted } = middleOf(was, is);
  for (const [index, table] of wanted.entries()) {
    const before = old[index];
    if (before && !compare([...path, String(first + index)], before, table)) return null;
  }
  for (let index = wanted.length; index < old.length; index += 1) {
    const place = placeOf(map, [...path, String(first + index)]);
    if (!place) return null;
    const blank = /^(?:[ \t]*\r?\n)*/.exec(text.slice(place.to))?.[0] ?? "";
    edits.push({ from: place.from, to: place.to + blank.length, text: "" });
  }
  const more = wanted.slice(old.length);
  const place = placeOf(map, [...path, String(Math.max(0, first + old.length - 1))]);
  if (more.length === 0) return edits;
  if (!place) return null;
  const newline = text.includes("\r\n") ? "\r\n" : "\n";
  const begins = place.to > 0 && text[place.to - 1] !== "\n" ? newline : "";
  const tables = more.map((table) => [heading, ...Object.entries(table).map(([key, value]) => `${keyText(key)} = ${valueText(value)}`)]);
  const at = first + old.length === 0 ? place.from : place.to;
  const put = tables.map((lines) => lines.map((line) => line + newline).join(""));
  edits.push({
    from: at,
    to: at,
    text: at === place.from ? put.map((one) => one + newline).join("") : begins + put.map((one) => newline + one).join(""),
  });
  return edits;
}

/** Returns the middle part in which two lists differ: its start, and its items in each list. */
function middleOf<T>(was: readonly T[], is: readonly T[]): { first: number; old: T[]; wanted: T[] } {
  const short = Math.min(was.length, is.length);
  let first = 0;
  while (first < short && same(was[first], is[first])) first += 1;
  let behind = 0;
  while (behind < short - first && same(was.at(-1 - behind), is.at(-1 - behind))) behind += 1;
  return { first, old: was.slice(first, was.length - behind), wanted: is.slice(first, is.length - behind) };
}

/** Returns the edit that deletes an array element with its comma, and with its line if nothing else is on it. */
function removedValue(text: string, spot: Spot): Edit {
  const behind = /^[ \t]*,(?:[ \t]*(?:#[^\n]*)?(?=\r?\n))?/.exec(text.slice(spot.to))?.[0] ?? "";
  const ahead = /\r?\n[ \t]*$/.exec(text.slice(0, spot.from))?.[0];
  if (ahead !== undefined) return { from: spot.from - ahead.length, to: spot.to + behind.length, text: "" };
  return removed(text, spot);
}

/** Returns the span from the header of a table to the end of its last line, including its subtables. */
function placeOf(map: Map_, path: readonly string[]): { from: number; to: number } | null {
  const own = [...map.sections.values()].filter((one) => path.every((key, index) => one.path[index] === key));
  if (own.length === 0) return null;
  return { from: Math.min(...own.map((one) => one.heading)), to: Math.max(...own.map((one) => one.at)) };
}

/** Returns the edit that deletes a key, either with its line or with its comma. */
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
  // Edits are applied from the end, so that earlier positions stay valid. Edits at one position keep their order.
  const order = edits.map((edit, index) => ({ ...edit, index })).sort((a, b) => b.from - a.from || b.index - a.index);
  for (const { from, to, text: put } of order) made = made.slice(0, from) + put + made.slice(to);
  return made;
}

function keyText(key: string): string {
  return /^[A-Za-z0-9_-]+$/.test(key) ? key : JSON.stringify(key);
}

/** Formats a value on one line. */
function valueText(value: unknown): string {
  if (Array.isArray(value)) return `[${value.map(valueText).join(", ")}]`;
  if (isTree(value)) {
    const pairs = Object.entries(value).filter(([, of]) => of !== undefined);
    return pairs.length === 0 ? "{}" : `{ ${pairs.map(([key, of]) => `${keyText(key)} = ${valueText(of)}`).join(", ")} }`;
  }
  // `stringify` writes only tables, so the value is taken from after the key.
  return stringify({ value })
    .replace(/^value = /, "")
    .trimEnd();
}
