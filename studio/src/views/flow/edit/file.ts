// SPDX-License-Identifier: Apache-2.0

import { parse as parseToml, TomlError } from "smol-toml";
import { tr } from "../../../language/text";
import { type Draft, type DrawnDefinition, definitionOf, FORMAT, type Graph, type Part, VERSION } from "./definition";
import type { OpenedFile } from "./history";
import { compositionOf, draftOf } from "./reading";
import { byName, sharedGraphs, withoutNewPlaces } from "./sharing";
import { patched, same } from "./toml";

type Tree = Record<string, unknown>;

/** Returns the text of a file with one definition and, for a composition, the verbs of which it consists. `gpac.load` can read it. */
export function fileText(draft: DrawnDefinition): string {
  return written(
    withDefinitions({ format: FORMAT, version: VERSION }, [[`${draft.kind}s`, draft.of.name, writtenDefinition(draft)], ...partsOf(draft)]),
  );
}

/** A file to be saved: its name, its text, and a message to the person. */
export interface SavedFile {
  name: string;
  text: string;
  said: string | null;
}

/** A definition in a file: section, key and content. */
type WrittenDefinition = [section: string, key: string, definition: Tree];

/**
 * Returns the draft as a file. If it was read from a file, the other content of that file (definitions, modules, description) is kept.
 * An unchanged draft yields the same text, byte for byte. In a TOML file only changed lines differ; if that is impossible, the file is
 * saved as JSON, without the comments. A graph that the file defines under a name is changed where it is defined.
 */
export function savedFile(draft: DrawnDefinition, file: OpenedFile | null): SavedFile {
  if (file === null) return { name: `${draft.of.name}.json`, text: fileText(draft), said: null };
  const opened = drawnIn(file.text, draft);
  if (opened && isUnchanged(draft, opened)) return { ...file, said: tr("flow.nothingWasChangedInTheFile") };
  const tree = readText(file.text) as Tree;
  const shared = sharedGraphs(draft, opened, tree, graphsOf(file.text));
  const changed = [...shared].filter(([, { was, is }]) => !same(was, is));
  const told = changed.map(([name]) => tr("flow.graphNameWasChangedAndWith", { name }));
  const name = (definition: Tree) => byName(definition, new Set(shared.keys()));
  const fresh = partsOf(draft).filter(([section, key]) => !Object.hasOwn((tree[section] as object | undefined) ?? {}, key));
  const ofGraphs = changed.map(([key, { is }]): WrittenDefinition => ["graphs", key, name(writtenDefinition({ kind: "graph", of: is }))]);
  const own: WrittenDefinition = [`${draft.kind}s`, draft.of.name, name(writtenDefinition(draft))];
  const text = written(withDefinitions(tree, [...ofGraphs, own, ...fresh]));
  if (file.text.trimStart().startsWith("{")) return { name: file.name, text, said: told.join("; ") || null };
  const asToml = opened && patchedText(draft, opened, file, tree, fresh, shared);
  if (asToml) return { name: file.name, text: asToml, said: told.join("; ") || null };
  const json = `${file.name.replace(/\.toml$/i, "")}.json`;
  return { name: json, text, said: [tr("flow.savedAsJsonWithoutTheComments", { json, name: file.name }), ...told].join("; ") };
}

/** Returns the TOML text with the changes of the draft applied; null if they cannot be applied to it. */
function patchedText(
  draft: DrawnDefinition,
  opened: DrawnDefinition,
  file: OpenedFile,
  tree: Tree,
  fresh: WrittenDefinition[],
  shared: ReturnType<typeof sharedGraphs>,
): string | null {
  const names = new Set(shared.keys());
  // Short forms in the file are preserved: only changes of the draft are written.
  const merge = (section: string, key: string, before: DrawnDefinition, now: DrawnDefinition): WrittenDefinition => {
    const [was, is] = [before, withoutNewPlaces(now, before)].map((one) => byName(writtenDefinition(one), names));
    return [section, key, merged((tree[section] as Record<string, Tree>)[key], was, is) as Tree];
  };
  const ofGraphs = [...shared].map(([key, { was, is }]) => merge("graphs", key, { kind: "graph", of: was }, { kind: "graph", of: is }));
  const after = withDefinitions(tree, [...ofGraphs, merge(`${draft.kind}s`, draft.of.name, opened, draft), ...fresh]);
  const text = patched(file.text, tree, after);
  const again = text === null ? undefined : drawnIn(text, draft);
  return again && same(meant(again), meant(withoutNewPlaces(draft, opened))) ? text : null;
}

function withDefinitions(tree: Tree, definitions: WrittenDefinition[]): Tree {
  const made = { ...tree };
  for (const [section, key, definition] of definitions) made[section] = { ...(made[section] as Tree | undefined), [key]: definition };
  return made;
}

/** Returns the verbs and compositions of which a composition consists, including the parts of nested compositions. */
function partsOf(draft: DrawnDefinition): WrittenDefinition[] {
  if (draft.kind !== "composition") return [];
  const found = new Map<string, WrittenDefinition>();
  const add = (parts: Record<string, string>) => {
    for (const name of Object.values(parts)) {
      const part = Object.hasOwn(draft.made_of, name) ? draft.made_of[name] : undefined;
      if (!part || found.has(name)) continue;
      found.set(name, [`${part.kind}s`, name, writtenDefinition(part.kind === "verb" ? part : { ...part, made_of: {} })]);
      if (part.kind === "composition") add(part.of.parts);
    }
  };
  add(draft.of.parts);
  return [...found.values()];
}

/** Returns a draft without the positions of its boxes. */
function meant(draft: DrawnDefinition): unknown {
  if (draft.kind !== "composition") return definitionOf(draft);
  const { layout: _drawing, ...of } = draft.of;
  return of;
}

/** Applies the changes between two drafts to the content of a file. */
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

/** Returns an array, or the commands of a command list, which a file may also write as an array. */
function listOf(value: unknown): unknown[] | null {
  if (Array.isArray(value)) return value;
  return isTable(value) && Object.keys(value).length === 1 && Array.isArray(value.commands) ? value.commands : null;
}

/** Applies the changes between two lists; unchanged items at the beginning and the end keep the file's short or long form. */
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

/** Returns whether the draft is equal to the file. Positions are compared only if the file contains positions. */
function isUnchanged(draft: DrawnDefinition, opened: DrawnDefinition): boolean {
  const said = (one: DrawnDefinition) => JSON.stringify(sorted(one.of));
  return said(opened) === said(withoutNewPlaces(draft, opened));
}

/** Returns the definition in a file with the same kind and name. */
function drawnIn(text: string, draft: DrawnDefinition): DrawnDefinition | undefined {
  return draftsOf(text).find((one) => one.kind === draft.kind && one.of.name === draft.of.name);
}

/** Sorts the keys of every table, because their order is irrelevant. Only the order of the command lists is kept. */
function sorted(value: unknown): unknown {
  if (Array.isArray(value)) return value.map(sorted);
  if (typeof value !== "object" || value === null) return value;
  return Object.entries(value)
    .sort(([one], [other]) => (one < other ? -1 : 1))
    .map(([key, of]) => [key, key === "command_lists" ? Object.entries(of as object).map(sorted) : sorted(of)]);
}

function writtenDefinition(draft: DrawnDefinition): Tree {
  const definition: Tree = { ...draft.of };
  delete definition.name;
  return definition;
}

function written(tree: object): string {
  return `${JSON.stringify(tree, null, 2)}\n`;
}

/** Describes the contents of a file other than graphs and verbs, which are kept when the file is saved. */
export function besides(text: string): string | null {
  const file = readText(text) as Record<string, unknown>;
  const names = (key: string) => Object.keys((file[key] as object | undefined) ?? {});
  const parts = [
    [tr("flow.deviceTypes"), names("device_types")],
    [tr("flow.modules"), names("modules")],
  ] as const;
  const said = parts.filter(([, of]) => of.length > 0).map(([what, of]) => `${what} (${of.join(", ")})`);
  return said.length === 0 ? null : tr("flow.theFileAlsoHasSaidThey", { said: said.join(", ") });
}

/** Parses the text of a file, JSON or TOML. */
function readText(text: string): unknown {
  if (text.trimStart().startsWith("{")) {
    try {
      return JSON.parse(text);
    } catch (why) {
      throw new Error(tr("flow.theFileIsNotValidJSON", { part: why instanceof Error ? why.message : String(why) }));
    }
  }
  try {
    return parseToml(text);
  } catch (why) {
    if (!(why instanceof TomlError)) throw why;
    throw new Error(tr("flow.theFileIsNeitherJSONNor", { line: why.line, column: why.column, value: why.message.split("\n")[0] }));
  }
}

/** Returns all compositions, verbs and graphs of a file. Throws an `Error` that explains why it is not a definition file. */
export function draftsOf(text: string): DrawnDefinition[] {
  const file = definitionsFile(text);
  const definitions = definitionsOf(text);
  const compositions = Object.entries(file.compositions ?? {}).map(([name, given]) => compositionOf(name, given));
  const parts = [...definitions.filter((one) => one.kind === "verb"), ...compositions.map((of): Part => ({ kind: "composition", of }))];
  const made_of: Record<string, Part> = Object.fromEntries(parts.map((one) => [one.of.name, one]));
  return [...compositions.map((of): DrawnDefinition => ({ kind: "composition", of, made_of })), ...definitions];
}

/** Returns all verbs and graphs of a file. Throws the same errors as `draftsOf`. */
export function definitionsOf(text: string): Draft[] {
  const { verbs = {}, graphs = {} } = definitionsFile(text);
  return [
    ...Object.entries(verbs).map(([name, given]) => draftOf("verb", name, given, graphs)),
    ...Object.entries(graphs).map(([name, given]) => draftOf("graph", name, given, graphs)),
  ];
}

function graphsOf(text: string): Map<string, Graph> {
  return new Map(definitionsOf(text).flatMap((one) => (one.kind === "graph" ? [[one.of.name, one.of]] : [])));
}

type Section = Record<string, unknown>;

function definitionsFile(text: string): { graphs?: Section; verbs?: Section; compositions?: Section } {
  const file = readText(text) as { format?: unknown; version?: unknown; graphs?: Section; verbs?: Section; compositions?: Section };
  if (file.format !== FORMAT) throw new Error(tr("flow.theFileIsNotAFile", { value: String(JSON.stringify(file.format)), FORMAT }));
  if (file.version !== VERSION)
    throw new Error(tr("flow.theFileHasVersionButThis", { value: String(JSON.stringify(file.version)), VERSION }));
  return file;
}

/** Offers text to the person as a download. */
export function download(name: string, text: string): void {
  const address = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  // By then, the browser has read it.
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
