// SPDX-License-Identifier: Apache-2.0
// Nested graphs: the path to one, and the whole draft after a change inside.
import { own } from "../../../design/own";
import { renamePorts } from "./change";
import type { BlockUse, Draft, Graph } from "./definition";
import { splitPort } from "./faces";
import { type Finding, isPort, type Where } from "./findings";

/** Path of labels from the outside in; empty for the whole. */
export type Way = readonly string[];

/** Returns the graph at the end of a path; null if it does not exist. */
export function within(whole: Draft, way: Way): Draft | null {
  let at: Draft = whole;
  for (const label of way) {
    const graph = graphAt(at.of.blocks, label);
    if (!graph) return null;
    at = { kind: "graph", of: graph };
  }
  return at;
}

/** Returns the longest prefix of a path that leads to a graph. A block on the path may have been removed or renamed. */
export function standing(whole: Draft, way: Way): Way {
  if (within(whole, way)) return way;
  for (let length = way.length - 1; length > 0; length -= 1) if (within(whole, way.slice(0, length))) return way.slice(0, length);
  return [];
}

/**
 * Replaces the graph at the end of a path. A graph is one definition, so all its uses are replaced. If one of its ports or blocks was
 * renamed, references from outside are renamed too.
 */
export function replaced(whole: Draft, way: Way, next: Draft): Draft {
  if (way.length === 0) return next;
  const before = within(whole, way);
  if (before?.kind !== "graph" || next.kind !== "graph") return whole;
  return exchanged(whole, { was: JSON.stringify(before.of), graph: before.of, is: next.of }).draft;
}

/** Gives one use of a graph its own copy of the graph, under a new name. */
export function ownGraph(draft: Draft, label: string, name: string): Draft {
  const graph = graphAt(draft.of.blocks, label);
  const use = own(draft.of.blocks, label);
  if (!graph || !use) return draft;
  return withBlocks(draft, { ...draft.of.blocks, [label]: { ...use, block: { graph: { ...graph, name } } } });
}

/** Returns all nested graphs by name, at every depth. If several graphs have the same name, only the first is returned. */
export function graphsWithin(draft: { of: { blocks: Record<string, BlockUse> } }): Map<string, Graph> {
  const found = new Map<string, Graph>();
  for (const use of Object.values(draft.of.blocks)) {
    if (!("graph" in use.block)) continue;
    const { graph } = use.block;
    for (const [name, one] of [[graph.name, graph] as const, ...graphsWithin({ of: graph })]) if (!found.has(name)) found.set(name, one);
  }
  return found;
}

/** Returns the findings about a nested graph, with names relative to it: its ports belong to the block with the empty label. */
export function findingsWithin(findings: Finding[], way: Way): Finding[] {
  if (way.length === 0) return findings;
  const own = way.join(".");
  return findings.flatMap((finding) => {
    const where = finding.where.flatMap((one) => inside(one, own));
    return where.length > 0 ? [{ ...finding, where }] : [];
  });
}

function inside(where: Where, own: string): Where[] {
  if ("cell" in where) return where.cell.startsWith(`${own}.`) ? [{ cell: where.cell.slice(own.length + 1) }] : [];
  if (!("block" in where)) return [];
  if (where.block === own) return isPort(where) ? [{ block: "", port: where.port }] : [];
  return where.block.startsWith(`${own}.`) ? [{ ...where, block: where.block.slice(own.length + 1) }] : [];
}

interface Exchange {
  /** Original graph, as JSON. */
  was: string;
  graph: Graph;
  is: Graph;
}

type Names = (name: string) => string;

/** Replaces a graph at every depth of a definition. `names` maps the old names of its ports and inner items to the new ones. */
function exchanged(draft: Draft, exchange: Exchange): { draft: Draft; names: Names | null } {
  const renames = new Map<string, Names>();
  let isChanged = false;
  const blocks = Object.entries(draft.of.blocks).map(([label, use]): [string, BlockUse] => {
    if (!("graph" in use.block)) return [label, use];
    const { graph } = use.block;
    const isIt = JSON.stringify(graph) === exchange.was;
    const made = isIt ? { draft: { of: exchange.is }, names: namesOf(exchange) } : exchanged({ kind: "graph", of: graph }, exchange);
    if (made.draft.of === graph) return [label, use];
    isChanged = true;
    if (made.names) renames.set(label, made.names);
    const { names } = made;
    const constants = names
      ? Object.fromEntries(Object.entries(use.constants).map(([name, value]) => [names(name), value]))
      : use.constants;
    return [label, { ...use, block: { graph: made.draft.of as Graph }, constants }];
  });
  if (!isChanged) return { draft, names: null };
  const made = withBlocks(draft, Object.fromEntries(blocks));
  if (renames.size === 0) return { draft: made, names: null };
  const renamed: Names = (name) => {
    const [label, rest] = splitPort(name, draft.of.blocks);
    const names = renames.get(label);
    return names && rest !== "" ? `${label}.${names(rest)}` : name;
  };
  return { draft: renamePorts(made, renamed), names: renamed };
}

/** Returns a function that maps the old names of the graph's ports and inner items to the new ones; null if none was renamed. */
function namesOf({ graph, is }: Exchange): Names | null {
  const ports = [renamedKey(graph.inputs, is.inputs), renamedKey(graph.outputs, is.outputs)].filter((one) => one !== null);
  const block = renamedKey(graph.blocks, is.blocks);
  if (ports.length === 0 && !block) return null;
  return (name) => {
    const port = ports.find(([was]) => was === name);
    if (port) return port[1];
    const [label, rest] = splitPort(name, graph.blocks);
    return block && label === block[0] && rest !== "" ? `${block[1]}.${rest}` : name;
  };
}

/** Returns the old and the new name if exactly one key was renamed without changing its position. */
export function renamedKey(was: object, is: object): [string, string] | null {
  const [old, now] = [Object.keys(was), Object.keys(is)];
  if (old.length !== now.length) return null;
  const others = old.flatMap((key, at) => (key === now[at] ? [] : [[key, now[at] ?? ""] as [string, string]]));
  const [only] = others;
  return others.length === 1 && only && !old.includes(only[1]) ? only : null;
}

function graphAt(blocks: Record<string, BlockUse>, label: string): Graph | null {
  const use = Object.hasOwn(blocks, label) ? blocks[label] : undefined;
  return use && "graph" in use.block ? use.block.graph : null;
}

function withBlocks(draft: Draft, blocks: Record<string, BlockUse>): Draft {
  return { ...draft, of: { ...draft.of, blocks } } as Draft;
}
