// SPDX-License-Identifier: Apache-2.0
import type { InstalledInstances, InstalledPort } from "../../control/shapes";

/** Data flow from one interrupt source to another. */
export interface Connection {
  from: string;
  to: string;
  /** Cells, with the mode in which they are read. */
  cells: { name: string; mode: string }[];
}

/** Returns the connections between sources: cells written by a block of one source and read by a block of another. */
export function connectionsOf(installed: InstalledInstances): Connection[] {
  const writers = new Map<string, Set<string>>();
  for (const block of blocksOf(installed)) {
    for (const port of block.ports) {
      if (port.direction === "output") for (const cell of cellsOf(port)) put(writers, cell, block.source);
    }
  }
  const found = new Map<string, Connection>();
  for (const block of blocksOf(installed)) {
    for (const port of block.ports) {
      if (port.direction !== "input") continue;
      for (const cell of cellsOf(port)) {
        for (const from of writers.get(cell) ?? []) {
          if (from !== block.source) add(found, from, block.source, cell, port.mode ?? "asynchronous");
        }
      }
    }
  }
  return [...found.values()].sort((a, b) => a.from.localeCompare(b.from) || a.to.localeCompare(b.to));
}

function add(found: Map<string, Connection>, from: string, to: string, name: string, mode: string): void {
  const key = `${from} ${to}`;
  const connection = found.get(key) ?? { from, to, cells: [] };
  found.set(key, connection);
  if (!connection.cells.some((cell) => cell.name === name && cell.mode === mode)) connection.cells.push({ name, mode });
}

function cellsOf(port: InstalledPort): string[] {
  return port.cells ?? (port.cell === null ? [] : [port.cell]);
}

function blocksOf(installed: InstalledInstances) {
  return installed.instances.filter((one) => one.state !== "ended" && one.state !== "deleted").flatMap((one) => one.blocks);
}

function put(map: Map<string, Set<string>>, key: string, value: string): void {
  const values = map.get(key) ?? new Set();
  values.add(value);
  map.set(key, values);
}
