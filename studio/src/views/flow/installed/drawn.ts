// SPDX-License-Identifier: Apache-2.0

import type { InstalledBlock, InstalledCell, InstalledInstance } from "../../../control/shapes";
import { period } from "../../../design/numbers";
import { tr } from "../../../language/text";
import type { Box, Drawing, Port, Wire } from "../drawing/drawing";

/** A port, and the box at which it is drawn: its block, or the closed graph that encloses the block. */
interface BoxPort {
  box: string;
  port: Port;
}

/**
 * Returns the data flow of installed instances. `opened` contains the ids of nested graphs whose blocks are shown; any other graph is a
 * single box with the ports that cross its edge.
 *
 * A private cell is a wire from its writer to each reader. An SVV or a channel, which may be shared, is a separate box.
 */
export function drawn(instances: InstalledInstance[], opened: ReadonlySet<string>): Drawing {
  const boxes = new Map<string, Box>();
  const wires = new Map<string, Wire>();
  for (const instance of instances) {
    for (const block of instance.blocks) addBlock(boxes, instance, block, opened);
    for (const cell of instance.cells) {
      if (cell.kind === "constant") continue;
      const find = ([label, port]: [string, string], side: "input" | "output") => endOf(boxes, instance, label, port, side, opened);
      const writers = cell.writers.map((at) => find(at, "output")).filter((end) => end !== null);
      const readers = cell.readers.map((at) => find(at, "input")).filter((end) => end !== null);
      if (cell.kind === "private") addPrivate(boxes, wires, cell, writers, readers);
      else addShared(boxes, wires, cell, writers, readers);
    }
  }
  return { boxes: [...boxes.values()], wires: [...wires.values()] };
}

/** Returns the ids of the nested graphs of an instance, outermost first: `move#1/outer`, `move#1/outer.inner`. */
export function graphsOf(instance: InstalledInstance): string[] {
  const found = new Set<string>();
  for (const block of instance.blocks) {
    const parts = block.label.split(".");
    for (let depth = 1; depth < parts.length; depth += 1) found.add(`${instance.name}/${parts.slice(0, depth).join(".")}`);
  }
  return [...found];
}

function addBlock(boxes: Map<string, Box>, instance: InstalledInstance, block: InstalledBlock, opened: ReadonlySet<string>): void {
  const closed = closedGraph(instance, block.label, opened);
  if (closed) {
    const known = boxes.get(closed.id);
    if (known) known.source = known.source === block.source ? known.source : null;
    else boxes.set(closed.id, boxOf(closed.id, "graph", closed.title, "graph", { doc: "", source: block.source, opens: "closed" }));
    return;
  }
  const every = block.every_ns ? tr("flow.everyEveryNs", { every_ns: period(block.every_ns) }) : "";
  const id = `${instance.name}/${block.label}`;
  const box = boxOf(id, "block", block.label, `${block.block.replace(/^library\./, "")} · ${block.source}${every}`, {
    doc: block.doc,
    source: block.source,
    opens: null,
  });
  for (const port of block.ports) {
    if (port.direction !== "input" && port.direction !== "output") continue;
    box.ports.push({
      name: port.name,
      side: port.direction,
      type_text: port.type_text,
      unit: port.unit ?? "",
      mode: port.mode ?? "",
      doc: port.doc,
    });
  }
  boxes.set(id, box);
}

function closedGraph(instance: InstalledInstance, label: string, opened: ReadonlySet<string>): { id: string; title: string } | null {
  const parts = label.split(".");
  for (let depth = 1; depth < parts.length; depth += 1) {
    const title = parts.slice(0, depth).join(".");
    const id = `${instance.name}/${title}`;
    if (!opened.has(id)) return { id, title };
  }
  return null;
}

function endOf(
  boxes: Map<string, Box>,
  instance: InstalledInstance,
  label: string,
  port: string,
  side: "input" | "output",
  opened: ReadonlySet<string>,
): BoxPort | null {
  const block = instance.blocks.find((one) => one.label === label);
  const said = block?.ports.find((one) => one.name === port);
  if (!block || !said) return null;
  const closed = closedGraph(instance, label, opened);
  const box = boxes.get(closed?.id ?? `${instance.name}/${label}`);
  if (!box) return null;
  const drawnSide = said.direction === "device" ? side : said.direction === "output" ? "output" : "input";
  const name = closed ? `${label.slice(closed.title.length + 1)}.${port}` : port;
  const drawnPort: Port = {
    name,
    side: drawnSide,
    type_text: said.type_text,
    unit: said.unit ?? "",
    mode: said.mode ?? "",
    doc: said.doc,
  };
  // A closed graph has only ports with wires; a device port is drawn only if a channel is bound to it.
  return { box: box.id, port: drawnPort };
}

function addPrivate(boxes: Map<string, Box>, wires: Map<string, Wire>, cell: InstalledCell, writers: BoxPort[], readers: BoxPort[]): void {
  let isLabelled = false;
  for (const writer of writers) {
    for (const reader of readers) {
      // The wire is inside a closed graph.
      if (writer.box === reader.box && boxes.get(writer.box)?.kind === "graph") continue;
      enter(boxes, writer);
      enter(boxes, reader);
      addWire(wires, cell, writer, reader, isLabelled ? null : cell.name);
      isLabelled = true;
    }
  }
  if (readers.length > 0) return;
  // A port without readers is drawn too.
  for (const writer of writers) if (boxes.get(writer.box)?.kind !== "graph") enter(boxes, writer);
}

function addShared(boxes: Map<string, Box>, wires: Map<string, Wire>, cell: InstalledCell, writers: BoxPort[], readers: BoxPort[]): void {
  if (writers.length + readers.length === 0) return;
  const id = `cell/${cell.name}`;
  const port = { name: "value", type_text: cell.type_text, unit: cell.unit ?? "", mode: "", doc: "" };
  let box = boxes.get(id);
  if (!box) {
    box = boxOf(id, cell.kind === "channel" ? "channel" : "svv", cell.name, cell.kind === "channel" ? tr("flow.deviceChannel") : "SVV", {
      doc: "",
      source: null,
      opens: null,
    });
    boxes.set(id, box);
  }
  // The value is shown only once, at the first wire.
  let live = cell.kind === "svv" && ![...wires.values()].some((wire) => wire.live === cell.name) ? cell.name : null;
  for (const writer of writers) {
    const to: BoxPort = { box: id, port: { ...port, side: "input" } };
    enter(boxes, writer);
    enter(boxes, to);
    addWire(wires, cell, writer, to, live);
    live = null;
  }
  for (const reader of readers) {
    const from: BoxPort = { box: id, port: { ...port, side: "output" } };
    enter(boxes, from);
    enter(boxes, reader);
    addWire(wires, cell, from, reader, live);
    live = null;
  }
}

function enter(boxes: Map<string, Box>, end: BoxPort): void {
  const ports = boxes.get(end.box)?.ports;
  if (ports && !ports.some((port) => port.name === end.port.name && port.side === end.port.side)) ports.push(end.port);
}

function addWire(wires: Map<string, Wire>, cell: InstalledCell, from: BoxPort, to: BoxPort, live: string | null): void {
  const id = `${cell.name}: ${from.box}.${from.port.name} → ${to.box}.${to.port.name}`;
  if (wires.has(id)) return;
  wires.set(id, {
    id,
    from: { box: from.box, port: from.port.name },
    to: { box: to.box, port: to.port.name },
    cell: cell.name,
    live,
    type_text: cell.type_text,
    unit: cell.unit ?? "",
    mode: to.port.mode,
    findings: [],
  });
}

function boxOf(id: string, kind: Box["kind"], title: string, about: string, more: Pick<Box, "doc" | "source" | "opens">): Box {
  return { id, kind, title, about, ports: [], findings: [], ...more };
}
