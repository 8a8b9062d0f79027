// SPDX-License-Identifier: Apache-2.0
// Graphs of a file that definitions of it name: what is drawn has them within, what is saved names them again.
import type { BlockUse, DrawnDefinition, Graph } from "./definition";
import { same } from "./toml";

type Tree = Record<string, unknown>;

/** A graph that the file defines, as it was and as the draft has it. */
interface SharedGraph {
  was: Graph;
  is: Graph;
}

/**
 * The graphs of the file that the saved definition names, rather than having them within: those that it named before, or has as the file
 * has them. A graph of which the draft has two versions under one name is none of them.
 */
export function sharedGraphs(
  draft: DrawnDefinition,
  opened: DrawnDefinition | undefined,
  tree: Tree,
  graphs: ReadonlyMap<string, Graph>,
): Map<string, SharedGraph> {
  const shared = new Map<string, SharedGraph>();
  if (draft.kind === "composition") return shared;
  const before = namedIn(opened && ((tree[`${opened.kind}s`] as Tree | undefined)?.[opened.of.name] as Tree | undefined), tree);
  for (const [name, uses] of usesOf(draft.of.blocks)) {
    const was = graphs.get(name);
    const [first] = uses;
    if (!was || !first || before.within.has(name) || uses.some((one) => !same(one, first))) continue;
    const is = asOpened(first, was);
    if (before.named.has(name) || same(is, was)) shared.set(name, { was, is });
  }
  return shared;
}

/** The definition with the names of these graphs in their places. */
export function byName(definition: Tree, names: ReadonlySet<string>): Tree {
  const blocks = definition.blocks as Record<string, BlockUse> | undefined;
  if (!blocks) return definition;
  const named = Object.entries(blocks).map(([label, use]): [string, unknown] => {
    if (!("graph" in use.block)) return [label, use];
    const { graph } = use.block;
    const block = names.has(graph.name) ? { subroutine: graph.name } : { graph: byName(graph, names) };
    return [label, { ...use, block }];
  });
  return { ...definition, blocks: Object.fromEntries(named) };
}

/** The draft without the places that it got because what was opened has none, of graphs within too. */
export function withoutNewPlaces<D extends DrawnDefinition>(draft: D, opened: DrawnDefinition): D {
  if (draft.kind === "composition") {
    return Object.keys(opened.of.layout).length > 0 ? draft : { ...draft, of: { ...draft.of, layout: {} } };
  }
  if (opened.kind === "composition") return draft;
  return { ...draft, of: asOpened(draft.of, opened.of) } as D;
}

function asOpened<T extends { blocks: Record<string, BlockUse>; layout: object }>(
  of: T,
  opened: { blocks: Record<string, BlockUse>; layout: object },
): T {
  const blocks = Object.entries(of.blocks).map(([label, use]): [string, BlockUse] => {
    const before = Object.hasOwn(opened.blocks, label) ? opened.blocks[label] : undefined;
    if (!("graph" in use.block) || !before || !("graph" in before.block)) return [label, use];
    return [label, { ...use, block: { graph: asOpened(use.block.graph, before.block.graph) } }];
  });
  const layout = Object.keys(opened.layout).length > 0 ? of.layout : {};
  return { ...of, blocks: Object.fromEntries(blocks), layout };
}

/** Every graph within, by name: each use of it. */
function usesOf(blocks: Record<string, BlockUse>, found = new Map<string, Graph[]>()): Map<string, Graph[]> {
  for (const use of Object.values(blocks)) {
    if (!("graph" in use.block)) continue;
    const { graph } = use.block;
    found.set(graph.name, [...(found.get(graph.name) ?? []), graph]);
    usesOf(graph.blocks, found);
  }
  return found;
}

/** Returns the graphs that a definition of the file names, and those that it has within, by their names; those of named graphs too. */
function namedIn(definition: Tree | undefined, tree: Tree, found = { named: new Set<string>(), within: new Set<string>() }) {
  const graphs = (tree.graphs as Record<string, Tree> | undefined) ?? {};
  for (const use of Object.values((definition?.blocks as Tree | undefined) ?? {})) {
    const block = typeof use === "string" ? use : (use as { block?: unknown }).block;
    const name = typeof block === "string" ? block : (block as { subroutine?: unknown } | undefined)?.subroutine;
    const inner = typeof block === "object" && block !== null ? (block as { graph?: Tree }).graph : undefined;
    if (inner) {
      if (typeof inner.name === "string") found.within.add(inner.name);
      namedIn(inner, tree, found);
    } else if (typeof name === "string" && Object.hasOwn(graphs, name) && !found.named.has(name)) {
      found.named.add(name);
      namedIn(graphs[name], tree, found);
    }
  }
  return found;
}
