// SPDX-License-Identifier: Apache-2.0
import { tr } from "../../../language/text";
import type { Box, Drawing, End, Port, Wire } from "../drawing/drawing";
import { allSets, isOutput, type NamedSet } from "./change";
import type { BlockUse, Draft, SetKind } from "./definition";
import { type Faces, type Item, inner, itemsOf, modeText, sideOf, splitPort } from "./faces";
import { about, type Finding, isPort } from "./findings";

/** A wire that was drawn and refused: it is shown with the reason, but is not part of the draft. */
export interface RefusedWire {
  from: End;
  to: End;
  reason: string;
}

const BOUNDARY: Record<SetKind, string> = {
  inputs: tr("flow.inputOfTheGraph"),
  outputs: tr("flow.outputOfTheGraph"),
  instantiation_parameters: tr("flow.instantiationParameter"),
  cells: "cell",
};

/** The only port of a boundary. */
const VALUE = "value";

/** Converts a draft to a drawing, with the findings at their boxes, ports and wires. */
export function drawnDraft(draft: Draft, faces: Faces, findings: Finding[], refused: RefusedWire | null): Drawing {
  const sides = allSets(draft).map((set) => sidesOf(draft, set, faces));
  const lost = new Map<string, Port[]>();
  for (const { ports, lost: gone } of sides)
    for (const [port, side] of ports)
      if (gone.has(port)) {
        const { box, port: name } = endOf(draft, port);
        const known = lost.get(box) ?? [];
        if (!known.some((one) => one.name === name && one.side === side)) lost.set(box, [...known, lostPort(name, side)]);
      }
  const boxes = Object.entries(draft.of.blocks).map(([label, use]) => blockBox(draft, label, use, faces, findings, lost.get(label) ?? []));
  const wires: Wire[] = [];
  for (const { set, ports } of sides) {
    const writers = set.ports.filter((port) => ports.get(port) === "output");
    const readers = set.ports.filter((port) => ports.get(port) === "input");
    if (set.kind === "cells") {
      for (const from of writers.map((port) => endOf(draft, port)))
        for (const to of readers.map((port) => endOf(draft, port))) wires.push(wireOf(draft, set, from, to, faces, findings));
      continue;
    }
    const boundary = boundaryBox(draft, set, writers, readers, faces, findings);
    boxes.push(boundary);
    const own = { box: boundary.id, port: VALUE };
    for (const port of writers) wires.push(wireOf(draft, set, endOf(draft, port), own, faces, findings));
    for (const port of readers) wires.push(wireOf(draft, set, own, endOf(draft, port), faces, findings));
  }
  if (refused) {
    const { from, to, reason } = refused;
    wires.push({ id: "refused", from, to, cell: "refused", live: null, type_text: "", unit: "", mode: "", findings: [reason] });
  }
  return { boxes, wires };
}

interface Sides {
  set: NamedSet;
  ports: Map<string, Port["side"]>;
  /** Ports that their blocks do not have, because a nested graph was changed or because the system does not know the block. */
  lost: Set<string>;
}

/** Returns the sides of the ports of a set. A missing port is drawn as a writer if the set needs one, otherwise as a reader. */
function sidesOf(draft: Draft, set: NamedSet, faces: Faces): Sides {
  const lost = new Set(set.ports.filter((port) => isLost(draft, port, faces)));
  const ports = new Map<string, Port["side"]>();
  let needsWriter = set.kind === "outputs" || (set.kind === "cells" && !set.ports.some((port) => isOutput(draft, port, faces)));
  for (const port of set.ports) {
    const writes = lost.has(port) ? needsWriter : isOutput(draft, port, faces);
    if (lost.has(port) && set.kind === "cells") needsWriter = false;
    ports.set(port, writes ? "output" : "input");
  }
  return { set, ports, lost };
}

/** Returns whether the port's block lacks that port. */
export function isLost(draft: Draft, port: string, faces: Faces): boolean {
  // The system's blocks may not be known yet.
  const [label, name] = splitPort(port, draft.of.blocks);
  const use = Object.hasOwn(draft.of.blocks, label) ? draft.of.blocks[label] : undefined;
  return use !== undefined && faces.size > 0 && !hasItem(use, name, faces);
}

/** Returns whether a use has an item, directly or in a nested block: `servo.pid.kp`. */
function hasItem(use: BlockUse, name: string, faces: Faces): boolean {
  if (itemsOf(use, faces).some((item) => item.name === name)) return true;
  if (!("graph" in use.block)) return false;
  const { blocks } = use.block.graph;
  const [label, rest] = splitPort(name, blocks);
  const within = Object.hasOwn(blocks, label) ? blocks[label] : undefined;
  return within !== undefined && rest !== "" && hasItem(within, rest, faces);
}

function lostPort(name: string, side: Port["side"]): Port {
  return { name, side, type_text: "", unit: "", mode: "", doc: tr("flow.thisPortDoesNotExist") };
}

/** Returns the set that a boundary's box represents. */
export function boundaryOf(draft: Draft, box: string): NamedSet | undefined {
  return allSets(draft).find((set) => `${set.kind}:${set.name}` === box);
}

/** Returns a port in the format of a definition; for a boundary, its set. */
export function portOf(draft: Draft, end: End): string | NamedSet | undefined {
  return Object.hasOwn(draft.of.blocks, end.box) ? `${end.box}.${end.port}` : boundaryOf(draft, end.box);
}

/** Returns a port in the format of the calls `check_definition` and `compatible`. */
export function placeOf(draft: Draft, end: End): { block: string; port: string } {
  const boundary = Object.hasOwn(draft.of.blocks, end.box) ? undefined : boundaryOf(draft, end.box);
  return boundary ? { block: "", port: boundary.name } : { block: end.box, port: end.port };
}

function blockBox(draft: Draft, label: string, use: BlockUse, faces: Faces, findings: Finding[], lost: Port[]): Box {
  const items = itemsOf(use, faces);
  const isGraph = !("subroutine" in use.block);
  const name = "subroutine" in use.block ? use.block.subroutine : use.block.graph.name;
  const face = faces.get(name);
  const isIn = (name: string) => isGraph && name.startsWith(`${label}.`);
  const found = findings.filter((finding) =>
    finding.where.some(
      (where) => ("block" in where && (where.block === label || isIn(where.block))) || ("cell" in where && isIn(where.cell)),
    ),
  );
  return {
    id: label,
    kind: isGraph ? "graph" : "block",
    title: label,
    about: isGraph ? tr("flow.graphName", { name }) : name.replace(/^library\./, ""),
    doc: isGraph ? (use.block as { graph: { doc: string } }).graph.doc : (face?.doc ?? tr("flow.thisBlockIsUnknownToThe")),
    ports: [...items.flatMap((item) => portsOf(item)), ...lost],
    source: null,
    opens: isGraph ? "closed" : null,
    findings: [
      ...lost.map(({ name: port, doc }) => ({ port, text: doc, key: doc })),
      ...found.flatMap((finding) => {
        if (isOfWire(draft, finding, faces)) return [];
        const port = finding.where.find((where) => "block" in where && where.block === label);
        return [{ port: port && isPort(port) ? port.port : null, text: about(finding), key: `${finding.class} ${finding.message}` }];
      }),
    ],
  };
}

/** Returns whether a finding belongs to a wire, that is, concerns both a writing and a reading port. Two writers do not share a wire. */
function isOfWire(draft: Draft, finding: Finding, faces: Faces): boolean {
  const ports = finding.where.filter(isPort);
  if (ports.some((port) => port.block === "")) return ports.length > 1;
  const writers = ports.filter((port) => isOutput(draft, `${port.block}.${port.port}`, faces));
  return writers.length > 0 && writers.length < ports.length;
}

function portsOf(item: Item): Port[] {
  const side = sideOf(item);
  if (!side) return [];
  return [{ name: item.name, side, type_text: item.type_text, unit: item.unit, mode: modeText(item.mode), doc: item.doc }];
}

function boundaryBox(draft: Draft, set: NamedSet, writers: string[], readers: string[], faces: Faces, findings: Finding[]): Box {
  const bound = [...writers, ...readers].map((port) => inner(draft.of, port, faces)).find((item) => item !== undefined);
  const port = (side: Port["side"]): Port => ({
    name: VALUE,
    side,
    type_text: bound?.type_text ?? "",
    unit: bound?.unit ?? "",
    mode: "",
    doc: BOUNDARY[set.kind],
  });
  const takes = set.kind === "outputs" || (set.kind === "instantiation_parameters" && (writers.length > 0 || readers.length === 0));
  const gives = set.kind === "inputs" || (set.kind === "instantiation_parameters" && (readers.length > 0 || writers.length === 0));
  const found = findings.filter((finding) => finding.where.some((where) => isSet(where, set.name)) && set.ports.length === 0);
  return {
    id: `${set.kind}:${set.name}`,
    kind: "boundary",
    title: set.name,
    about: BOUNDARY[set.kind],
    doc: "",
    ports: [...(takes ? [port("input")] : []), ...(gives ? [port("output")] : [])],
    source: null,
    opens: null,
    findings: found.map((finding) => ({ port: null, text: about(finding), key: `${finding.class} ${finding.message}` })),
  };
}

function isSet(where: Finding["where"][number], name: string): boolean {
  return ("cell" in where && where.cell === name) || ("block" in where && where.block === "" && isPort(where) && where.port === name);
}

function wireOf(draft: Draft, set: NamedSet, from: End, to: End, faces: Faces, findings: Finding[]): Wire {
  const item = inner(draft.of, `${to.box}.${to.port}`, faces) ?? inner(draft.of, `${from.box}.${from.port}`, faces);
  const found = findings.filter((finding) => isAbout(finding, set, placeOf(draft, from), placeOf(draft, to))).map(about);
  // A wire at a missing port is marked at once, before the system reports it.
  if (found.length === 0) found.push(...[from, to].flatMap((end) => lostText(draft, end, faces) ?? []));
  return {
    id: `${from.box} ${from.port} → ${to.box} ${to.port}`,
    from,
    to,
    cell: set.name,
    live: null,
    type_text: item?.type_text ?? "",
    unit: item?.unit ?? "",
    mode: item ? modeText(item.mode) : "",
    findings: found,
  };
}

function lostText(draft: Draft, end: End, faces: Faces): string | null {
  const use = Object.hasOwn(draft.of.blocks, end.box) ? draft.of.blocks[end.box] : undefined;
  if (!use || !isLost(draft, `${end.box}.${end.port}`, faces)) return null;
  const [of, whole] =
    "graph" in use.block
      ? [tr("flow.graphName", { name: use.block.graph.name }), tr("flow.theGraph")]
      : [use.block.subroutine, tr("flow.theBlock")];
  return tr("flow.boxOfHasNoPortPort", { box: end.box, of, port: end.port, whole });
}

/** Returns whether a finding concerns this wire: it names both ends of the wire, or its cell and no port elsewhere. */
function isAbout(finding: Finding, set: NamedSet, from: { block: string; port: string }, to: { block: string; port: string }): boolean {
  const ports = finding.where.filter(isPort);
  const same = (one: { block: string; port: string }) =>
    ports.some((other) => one.block === other.block && (one.port === other.port || one.block === ""));
  if (ports.length > 1) return same(from) && same(to);
  const ofCell = finding.where.some((where) => "cell" in where && where.cell === set.name);
  return ofCell && (ports.length === 0 || same(from) || same(to));
}

function endOf(draft: Draft, port: string): End {
  const [box, name] = splitPort(port, draft.of.blocks);
  return { box, port: name };
}
