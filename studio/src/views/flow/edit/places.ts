// SPDX-License-Identifier: Apache-2.0
// Positions of a draft's boxes, and the parts deleted when boxes and wires are removed from the drawing.
import { own } from "../../../design/own";
import type { Place, Wire } from "../drawing/drawing";
import * as change from "./change";
import { type Draft, setsOf } from "./definition";
import { boundaryOf, isLost } from "./drawn";
import type { Faces } from "./faces";

export function placed(draft: Draft): boolean {
  const labels = Object.keys(draft.of.blocks);
  return labels.length === 0 || labels.some((label) => Object.hasOwn(draft.of.layout, label));
}

/** Returns the positions of all boxes; boxes without a position are placed in a row to the right of the others. */
export function placesOf(boxes: { id: string }[], draft: Draft): Map<string, Place> {
  const free = freePlace(draft);
  let next = 0;
  return new Map(
    boxes.map((box) => {
      const known = own(draft.of.layout, box.id);
      if (!known) next += 1;
      return [box.id, known ?? { x: free.x + (next - 1) * 240, y: free.y }];
    }),
  );
}

export function freePlace(draft: Draft): Place {
  const known = Object.entries(draft.of.layout).filter(([what]) => !what.startsWith("list:"));
  const right = Math.max(0, ...known.map(([, at]) => at.x + 240));
  const top = Math.min(...known.map(([, at]) => at.y), 40);
  return { x: right, y: top };
}

/** Removes a cell if it has only missing ports left after its last wire was removed. */
function withoutLost(draft: Draft, cell: string, faces: Faces): Draft {
  const left = own(setsOf(draft, "cells"), cell) ?? [];
  return left.length > 0 && left.every((port) => isLost(draft, port, faces)) ? change.removeSet(draft, "cells", cell) : draft;
}

/** Removes boxes and wires of the drawing from the draft. */
export function removed(draft: Draft, boxes: string[], wires: string[], drawn: Wire[], faces: Faces): Draft {
  let next = draft;
  for (const id of wires) {
    const wire = drawn.find((one) => one.id === id);
    if (!wire || id === "refused") continue;
    const [from, to] = [`${wire.from.box}.${wire.from.port}`, `${wire.to.box}.${wire.to.port}`];
    const boundary = boundaryOf(next, wire.to.box);
    if (boundary) next = change.release(next, boundary.kind, boundary.name, from);
    else next = withoutLost(change.disconnect(next, to, faces), wire.cell, faces);
  }
  for (const box of boxes) {
    const set = boundaryOf(next, box);
    if (set && own(setsOf(next, set.kind), set.name)) next = change.removeSet(next, set.kind, set.name);
    else if (Object.hasOwn(next.of.blocks, box)) next = change.removeBlock(next, box);
  }
  return next;
}
