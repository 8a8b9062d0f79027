// SPDX-License-Identifier: Apache-2.0
// React Flow looks for nodes and handles with `[data-id="…"]`: names, which may be anything, become ids that stand between these quotes.

/** The id of what has a name; that of most names is the name. */
export function nodeId(name: string): string {
  return name.replace(/["\\%\n\r\f]/g, encodeURIComponent);
}

/** The name of what has an id. */
export function nodeName(id: string): string {
  return decodeURIComponent(id);
}
