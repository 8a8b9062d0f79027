// SPDX-License-Identifier: Apache-2.0
// Graphs of a file that its definitions name: the drawing contains them, the saved file names them again.
import type { BlockUse, DrawnDefinition, Graph } from "./definition";
import { same } from "./toml";

type Tree = Record<string, unknown>;

/** A graph defined in the file: the original, and the version in the draft. */
interface SharedGraph {
  was: Graph;
  is: Graph;
}

/**
 * Returns the graphs of the file to which the saved definition refers by name instead of containing them: those to which it already
 * referred, and those that are equal to the file's version. A graph with two different versions in the draft is excluded.
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

/** Replaces these graphs in a definition with their names. */
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

/** Returns the draft with the positions removed from its graph, and from each nested graph, that had none when it was opened. */
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

/** Returns all uses of nested graphs, by name. */
function usesOf(blocks: Record<string, BlockUse>, found = new Map<string, Graph[]>()): Map<string, Graph[]> {
  for (const use of Object.values(blocks)) {
    if (!("graph" in use.block)) continue;
    const { graph } = use.block;
    found.set(graph.name, [...(found.get(graph.name) ?? []), graph]);
    usesOf(graph.blocks, found);
  }
  return found;
}

/**
 * Returns the names of the graphs to which a definition in the file refers, and the names of those that it contains. In both cases,
 * graphs within referenced graphs are included.
 */
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
