// SPDX-License-Identifier: Apache-2.0

import { nameParts } from "../../../design/nameParts";
import { unitText } from "../../../design/units";
import { tr } from "../../../language/text";
// A data flow graph as it is drawn: boxes with ports, and wires between them. It is made from installed instances or from a draft.

export type PortSide = "input" | "output";

export interface Port {
  name: string;
  side: PortSide;
  type_text: string;
  unit: string;
  /** "synchronous", "asynchronous" or "ratio 5"; empty if unspecified. */
  mode: string;
  doc: string;
}

export type BoxKind = "block" | "graph" | "svv" | "channel" | "boundary";

export interface Box {
  id: string;
  kind: BoxKind;
  /** Label of the box. */
  title: string;
  /** The block, the source that runs it, and its rate, on one line. */
  about: string;
  doc: string;
  ports: Port[];
  /** Interrupt source that runs the block, which determines its colour; null if the block is not placed. */
  source: string | null;
  /** Findings about the box or one of its ports, in words. */
  findings: PortFinding[];
  /** State of a nested graph that can be opened or closed. */
  opens: "open" | "closed" | null;
}

export interface PortFinding {
  /** Port that the finding is about; null for the box itself. */
  port: string | null;
  text: string;
  /** Key of the finding: equal keys on several boxes are the same finding. */
  key: string;
}

/** One end of a wire. */
export interface End {
  box: string;
  port: string;
}

export interface Wire {
  id: string;
  from: End;
  to: End;
  /** Name of the cell, shown at the middle of the wire. */
  cell: string;
  /** Name under which the current value can be read; null if it cannot be read. */
  live: string | null;
  type_text: string;
  unit: string;
  /** Mode of the relation: synchronous wires are drawn solid, asynchronous ones dashed. */
  mode: string;
  findings: string[];
}

export interface Drawing {
  boxes: Box[];
  wires: Wire[];
}

export interface Place {
  x: number;
  y: number;
}

/** Sizes of the parts of a box, px; the layout needs them before the box is rendered. */
export const HEAD = 42;
export const ROW = 20;
const FOOT = 6;
const LETTER = 6.7;

export function inputsOf(box: Box): Port[] {
  return box.ports.filter((port) => port.side === "input");
}

export function outputsOf(box: Box): Port[] {
  return box.ports.filter((port) => port.side === "output");
}

export function sizeOf(box: Box): { width: number; height: number } {
  const [inputs, outputs] = [inputsOf(box), outputsOf(box)];
  const longest = (ports: Port[]) => Math.max(0, ...ports.map((port) => port.name.length));
  const letters = Math.max(box.title.length + (box.opens ? 3 : 0), box.about.length * 0.9, longest(inputs) + longest(outputs) + 4);
  const rows = Math.max(inputs.length, outputs.length);
  return { width: Math.min(320, Math.max(96, Math.ceil(letters * LETTER + 24))), height: HEAD + rows * ROW + FOOT };
}

/** Margin of a title within its box, and the width of a letter relative to its size. */
export const [TITLE_EDGE, TITLE_LETTER] = [14, 0.66];

/** Height of a line of a title relative to its text size, and the decrement in the search for a size that fits, px. */
export const TITLE_LINE = 1.15;
const TITLE_STEP = 0.5;

/**
 * Returns the maximum text size at which a box's title fits into the box, px: a title wraps only between its parts, none of which may be
 * wider than the box, and its lines must not be higher than the box.
 */
export function titleSize(box: Box): number {
  const { width, height } = sizeOf(box);
  const lengths = nameParts(box.title).map((part) => part.length);
  const room = width - TITLE_EDGE;
  let size = room / (TITLE_LETTER * Math.max(1, ...lengths));
  while (size > TITLE_STEP && linesOf(lengths, room / (TITLE_LETTER * size)) * TITLE_LINE * size > height - FOOT) size -= TITLE_STEP;
  return size;
}

/** Returns the number of lines of parts of these lengths if a line has space for `letters`. */
function linesOf(lengths: readonly number[], letters: number): number {
  let [lines, used] = [1, 0];
  for (const length of lengths) {
    if (used > 0 && used + length > letters + 1e-9) [lines, used] = [lines + 1, 0];
    used += length;
  }
  return lines;
}

/** Returns the distance of a port's centre from the top edge of its box. */
export function portAt(box: Box, port: Port): number {
  const row = box.ports.filter((one) => one.side === port.side).indexOf(port);
  return HEAD + row * ROW + ROW / 2;
}

/** Describes a port: "double[6] in rad, synchronous". */
export function portText(port: Pick<Port, "type_text" | "unit" | "mode">): string {
  const of = port.unit ? tr("flow.typeTextInUnit", { type_text: port.type_text, unit: unitText(port.unit) }) : port.type_text;
  return port.mode ? `${of}, ${port.mode}` : of;
}

/** Selected box or wire of a drawing. */
export type Selection = { kind: "box" | "wire"; id: string } | null;
