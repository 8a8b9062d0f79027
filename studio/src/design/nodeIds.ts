// SPDX-License-Identifier: Apache-2.0
// React Flow finds nodes and handles with `[data-id="…"]`: arbitrary names are converted to IDs that are valid between these quotes.

/** Returns the id for a name; for most names, the id is the name itself. */
export function nodeId(name: string): string {
  return name.replace(/["\\%\n\r\f]/g, encodeURIComponent);
}

/** Returns the id of a port of a node. It is the same in all languages: a wire whose id no port has is not drawn. */
export function handleId(side: "input" | "output", port: string): string {
  return `${side} ${nodeId(port)}`;
}

/** Returns the name for an id. */
export function nodeName(id: string): string {
  return decodeURIComponent(id);
}
