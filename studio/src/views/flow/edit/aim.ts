// SPDX-License-Identifier: Apache-2.0
// Target of a finding: the part to draw and select when it is pressed, and the field that gets the focus.
import type { Selection } from "../drawing/drawing";
import type { Draft } from "./definition";
import { drawnDraft } from "./drawn";
import type { Faces } from "./faces";
import { about, type Finding, isPort, type Where } from "./findings";
import { findingsWithin, type Way, within } from "./nested";

export interface Aim {
  /** Path of the graph that contains the finding. */
  way: Way;
  shown: "flow" | "lists";
  chosen: Selection;
  /** Box to be centred. */
  box: string | null;
  list: string | null;
  /** `data-place` of the field next to the drawing. */
  field: string | null;
}

/** Field for findings about the whole definition, or about something that is not drawn. */
export const WHOLE = "whole";

/** Returns the target of a finding: the first of its locations that exists. */
export function aimOf(whole: Draft, faces: Faces, finding: Finding): Aim {
  for (const where of finding.where) {
    const aim = "block" in where || "cell" in where ? inDrawing(whole, faces, finding, where) : beside(whole, where);
    if (aim) return aim;
  }
  return { way: [], shown: "flow", chosen: null, box: null, list: null, field: WHOLE };
}

function beside(whole: Draft, where: Where): Aim | null {
  if (whole.kind !== "verb") return null;
  const at = (field: string, list: string | null = null): Aim => ({
    way: [],
    shown: list === null ? "flow" : "lists",
    chosen: null,
    box: null,
    list,
    field,
  });
  if ("list" in where) return at(where.command === undefined ? `list:${where.list}` : `list:${where.list}:${where.command}`, where.list);
  if ("transition" in where) return at(`transition:${where.transition.join(":")}`, where.transition[0]);
  const [[kind, name] = ["", ""]] = Object.entries(where);
  return at(`${kind}:${name}`);
}

function inDrawing(whole: Draft, faces: Faces, finding: Finding, where: Where): Aim | null {
  const way = wayOf(whole, where);
  const draft = within(whole, way);
  const [local] = findingsWithin([finding], way);
  if (!draft || !local) return null;
  const drawing = drawnDraft(draft, faces, [local], null);
  const aim = (chosen: Selection, box: string | null, field: string | null): Aim => ({
    way,
    shown: "flow",
    chosen,
    box,
    list: null,
    field,
  });
  const wire = drawing.wires.find((one) => one.findings.includes(about(local)));
  if (wire) return aim({ kind: "wire", id: wire.id }, wire.to.box, null);
  const first = local.where[0];
  const named = first && "block" in first ? first.block : null;
  const box = drawing.boxes.find((one) => one.id === named) ?? drawing.boxes.find((one) => one.findings.length > 0);
  if (!box) return null;
  return aim({ kind: "box", id: box.id }, box.id, first && isPort(first) ? `item:${first.port}` : null);
}

/** Returns the path of the graph that contains a block or cell: `outer.inner.gain` is drawn in the graph at `outer.inner`. */
function wayOf(whole: Draft, where: Where): Way {
  const name = "block" in where ? where.block : "cell" in where ? where.cell : "";
  let way: string[] = [];
  let rest = name;
  for (let at: Draft | null = whole; at !== null; at = within(whole, way)) {
    const label = Object.keys(at.of.blocks).find((one) => rest.startsWith(`${one}.`) && "graph" in (at?.of.blocks[one]?.block ?? {}));
    if (label === undefined) return way;
    way = [...way, label];
    rest = rest.slice(label.length + 1);
  }
  return way;
}
