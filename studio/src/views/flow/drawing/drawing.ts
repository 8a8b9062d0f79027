// SPDX-License-Identifier: Apache-2.0
import { unitText } from "../../../design/units";
// What a data flow graph looks like: boxes with ports, wires between ports. Made from what is installed, or from what is drawn.

export type PortSide = "input" | "output";

export interface Port {
  name: string;
  side: PortSide;
  type_text: string;
  unit: string;
  /** "synchronous", "asynchronous", "ratio 5"; empty where nothing is said. */
  mode: string;
  doc: string;
}

export type BoxKind = "block" | "graph" | "svv" | "channel" | "boundary";

export interface Box {
  id: string;
  kind: BoxKind;
  /** Its label. */
  title: string;
  /** The block that it is, the source that runs it, how often: one line. */
  about: string;
  doc: string;
  ports: Port[];
  /** The interrupt source that runs it, for its colour; null where it is not placed. */
  source: string | null;
  /** Faults of it, or of one of its ports, in words. */
  findings: PortFinding[];
  /** A nested graph that can be opened or closed. */
  opens: "open" | "closed" | null;
}

export interface PortFinding {
  /** null: the box itself. */
  port: string | null;
  text: string;
  /** Told from the same finding of other boxes by this. */
  key: string;
}

/** End of a wire. */
export interface End {
  box: string;
  port: string;
}

export interface Wire {
  id: string;
  from: End;
  to: End;
  /** Name of the cell, shown at its middle. */
  cell: string;
  /** The name under which its present value is to be had; null: it has none. */
  live: string | null;
  type_text: string;
  unit: string;
  /** A synchronous relation is drawn whole, an asynchronous one dashed. */
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

/** Sizes of a box, px: the layout must know them before anything is drawn. */
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

/** Where a port's middle lies, from the upper edge of its box. */
export function portAt(box: Box, port: Port): number {
  const row = box.ports.filter((one) => one.side === port.side).indexOf(port);
  return HEAD + row * ROW + ROW / 2;
}

/** "double[6] in rad, synchronous". */
export function portText(port: Pick<Port, "type_text" | "unit" | "mode">): string {
  const of = port.unit ? `${port.type_text} in ${unitText(port.unit)}` : port.type_text;
  return port.mode ? `${of}, ${port.mode}` : of;
}

/** Choice in a drawing. */
export type Selection = { kind: "box" | "wire"; id: string } | null;
