// SPDX-License-Identifier: Apache-2.0
import { parse as parseToml, TomlError } from "smol-toml";
import { type Draft, definitionOf, draftOf, FORMAT, VERSION } from "./definition";
import type { OpenedFile } from "./history";
import { patched, same } from "./toml";

/** The text of a file with one definition: what `gpac.load` reads. */
export function fileText(draft: Draft): string {
  return written({ format: FORMAT, version: VERSION, [`${draft.kind}s`]: { [draft.of.name]: writtenDefinition(draft) } });
}

/** A file that is saved: its name, its text, and what a person is to know of it. */
export interface Saved {
  name: string;
  text: string;
  said: string | null;
}

/**
 * The draft as a file. One that was opened keeps all else that it has: other definitions, compositions, modules, its description. What
 * was not changed is the same text, byte for byte. In a TOML file only the lines of what was changed are others; one of which that cannot
 * be done becomes JSON, since its comments cannot follow.
 */
export function savedFile(draft: Draft, file: OpenedFile | null): Saved {
  if (file === null) return { name: `${draft.of.name}.json`, text: fileText(draft), said: null };
  if (isUnchanged(draft, file)) return { ...file, said: "nothing was changed: the file is as it was" };
  const tree = readText(file.text) as Record<string, unknown>;
  const kind = `${draft.kind}s`;
  const known = (tree[kind] as Record<string, unknown> | undefined) ?? {};
  const after = { ...tree, [kind]: { ...known, [draft.of.name]: writtenDefinition(draft) } };
  const text = written(after);
  if (file.text.trimStart().startsWith("{")) return { name: file.name, text, said: null };
  const kept = inToml(draft, file, tree);
  if (kept !== null) return { name: file.name, text: kept, said: null };
  const name = `${file.name.replace(/\.toml$/i, "")}.json`;
  return { name, text, said: `saved as ${name}: the comments of ${file.name} stay in ${file.name} alone` };
}

/** The TOML file with the changes of the draft; null where they cannot be written into it. */
function inToml(draft: Draft, file: OpenedFile, tree: Record<string, unknown>): string | null {
  const kind = `${draft.kind}s`;
  const opened = draftsOf(file.text).find((one) => one.kind === draft.kind && one.of.name === draft.of.name);
  if (!opened) return null;
  // What the file says in short stays so: only what the draft has changed is written.
  const [was, is] = [writtenDefinition(opened), writtenDefinition(draft)];
  if (Object.keys(opened.of.layout).length === 0) {
    was.layout = {};
    is.layout = {};
  }
  const known = (tree[kind] as Record<string, Record<string, unknown>>)[draft.of.name];
  const after = { ...tree, [kind]: { ...(tree[kind] as object), [draft.of.name]: merged(known, was, is) } };
  const text = patched(file.text, tree, after as Record<string, unknown>);
  if (text === null) return null;
  const again = draftsOf(text).find((one) => one.kind === draft.kind && one.of.name === draft.of.name);
  return again && same(definitionOf(again), definitionOf(draft)) ? text : null;
}

/** What a file says, with what has become another between two drafts of it. */
function merged(said: unknown, was: unknown, is: unknown): unknown {
  if (same(was, is)) return said;
  if (Array.isArray(said)) {
    const [old, wanted] = [listOf(was), listOf(is)];
    return old && wanted && old.length === said.length ? mergedList(said, old, wanted) : is;
  }
  if (!isTable(said) || !isTable(was) || !isTable(is)) return is;
  const made: Record<string, unknown> = { ...said };
  for (const key of new Set([...Object.keys(was), ...Object.keys(is)])) {
    if (is[key] === undefined) delete made[key];
    else if (!same(was[key], is[key])) made[key] = merged(said[key], was[key], is[key]);
  }
  return made;
}

/** An array, or the commands of a command list, which a file may write as an array. */
function listOf(value: unknown): unknown[] | null {
  if (Array.isArray(value)) return value;
  return isTable(value) && Object.keys(value).length === 1 && Array.isArray(value.commands) ? value.commands : null;
}

/** Of what is the same at the beginning and at the end stays what the file says, in short or long. */
function mergedList(said: unknown[], was: unknown[], is: unknown[]): unknown[] {
  const short = Math.min(was.length, is.length);
  let first = 0;
  while (first < short && same(was[first], is[first])) first += 1;
  let behind = 0;
  while (behind < short - first && same(was.at(-1 - behind), is.at(-1 - behind))) behind += 1;
  return [...said.slice(0, first), ...is.slice(first, is.length - behind), ...said.slice(said.length - behind)];
}

function isTable(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** Whether the draft says what the file says of it. Places count where the file has some. */
function isUnchanged(draft: Draft, file: OpenedFile): boolean {
  const before = draftsOf(file.text).find((one) => one.kind === draft.kind && one.of.name === draft.of.name);
  if (!before) return false;
  const hasPlaces = Object.keys(before.of.layout).length > 0;
  const said = (one: Draft) => JSON.stringify(sorted(hasPlaces ? one.of : definitionOf(one)));
  return said(before) === said(draft);
}

/** The same with the keys of every table in one order: what order they stand in says nothing, but that of command lists. */
function sorted(value: unknown): unknown {
  if (Array.isArray(value)) return value.map(sorted);
  if (typeof value !== "object" || value === null) return value;
  return Object.entries(value)
    .sort(([one], [other]) => (one < other ? -1 : 1))
    .map(([key, of]) => [key, key === "command_lists" ? Object.entries(of as object).map(sorted) : sorted(of)]);
}

function writtenDefinition(draft: Draft): Record<string, unknown> {
  const definition: Record<string, unknown> = { ...definitionOf(draft), layout: draft.of.layout };
  delete definition.name;
  return definition;
}

function written(tree: object): string {
  return `${JSON.stringify(tree, null, 2)}\n`;
}

/** What a file has besides graphs and verbs, in words; it is kept when the file is saved. */
export function besides(text: string): string | null {
  const file = readText(text) as Record<string, unknown>;
  const names = (key: string) => Object.keys((file[key] as object | undefined) ?? {});
  const parts = [
    ["compositions", names("compositions")],
    ["device types", names("device_types")],
    ["modules", names("modules")],
  ] as const;
  const said = parts.filter(([, of]) => of.length > 0).map(([what, of]) => `${what} (${of.join(", ")})`);
  return said.length === 0 ? null : `The file also has ${said.join(", ")}. They are not drawn here, and stay as they are when it is saved.`;
}

/** What the text of a file says, JSON or TOML. */
function readText(text: string): unknown {
  if (text.trimStart().startsWith("{")) {
    try {
      return JSON.parse(text);
    } catch (why) {
      throw new Error(`the JSON of this file is broken: ${why instanceof Error ? why.message : String(why)}`);
    }
  }
  try {
    return parseToml(text);
  } catch (why) {
    if (!(why instanceof TomlError)) throw why;
    throw new Error(`this is neither JSON nor TOML: line ${why.line}, column ${why.column}: ${why.message.split("\n")[0]}`);
  }
}

/** Every graph and verb of a file. Errors: what it is instead, in words. */
export function draftsOf(text: string): Draft[] {
  const file = readText(text) as { format?: unknown; version?: unknown; graphs?: Record<string, unknown>; verbs?: Record<string, unknown> };
  if (file.format !== FORMAT)
    throw new Error(`this is no file of definitions: its format is ${JSON.stringify(file.format)}, not "${FORMAT}"`);
  if (file.version !== VERSION)
    throw new Error(`the file has version ${JSON.stringify(file.version)}; this studio knows version ${VERSION}`);
  const graphs = file.graphs ?? {};
  return [
    ...Object.entries(file.verbs ?? {}).map(([name, written]) => draftOf("verb", name, written, graphs)),
    ...Object.entries(graphs).map(([name, written]) => draftOf("graph", name, written, graphs)),
  ];
}

/** Hands a text to the person as a file. */
export function download(name: string, text: string): void {
  const address = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  // The browser has taken it by then.
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
