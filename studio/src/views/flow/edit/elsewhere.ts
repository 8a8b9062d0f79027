// SPDX-License-Identifier: Apache-2.0
// Objects of a draft in nested graphs, and around the graph that is drawn.
import { type Findable, findables } from "../drawing/Find";
import type { Draft } from "./definition";
import { drawnDraft } from "./drawn";
import type { Faces } from "./faces";
import type { Way } from "./nested";

/**
 * Returns the objects of the whole draft and of every nested graph, separately for each use of the graph. `go` opens the graph at the
 * end of a path.
 */
export function everythingIn(whole: Draft, faces: Faces, go: (way: Way) => void): Findable[] {
  return graphsAlong(whole, []).flatMap(({ draft, at }) => {
    const within = { text: [whole.of.name, ...at].join(" › "), open: () => go(at) };
    return findables(drawnDraft(draft, faces, [], null), at.join(".")).map((one) => ({ ...one, within }));
  });
}

function graphsAlong(draft: Draft, at: Way): { draft: Draft; at: Way }[] {
  const within = Object.entries(draft.of.blocks).flatMap(([label, use]) =>
    "graph" in use.block ? graphsAlong({ kind: "graph", of: use.block.graph }, [...at, label]) : [],
  );
  return [{ draft, at }, ...within];
}
