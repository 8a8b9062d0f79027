// SPDX-License-Identifier: Apache-2.0
// A workspace as a JSON file, which a program can ship.
import type { Workspace } from "../../control/shapes";

/** Version of the file format. */
const FORMAT = 1;

export function fileText(workspace: Workspace): string {
  return `${JSON.stringify({ workspace: FORMAT, ...workspace }, null, 2)}\n`;
}

export function fileName(workspace: Workspace): string {
  return `${workspace.name.replace(/[^\p{L}\p{N}._-]+/gu, "-")}.workspace.json`;
}

/** Parses a workspace from a file. Throws an `Error` that describes the mistake; the layout itself is checked by the system. */
export function fromFile(text: string): Workspace {
  let said: unknown;
  try {
    said = JSON.parse(text);
  } catch (why) {
    throw new Error(`the file is not a workspace: ${why instanceof Error ? why.message : why}`);
  }
  if (typeof said !== "object" || said === null || !("layout" in said)) throw new Error("the file is not a workspace: it has no 'layout'");
  const { workspace = FORMAT, ...rest } = said as { workspace?: unknown } & Workspace;
  if (workspace !== FORMAT)
    throw new Error(`the file has version ${JSON.stringify(workspace)} of the format of workspaces, but this page reads ${FORMAT}`);
  return rest;
}
