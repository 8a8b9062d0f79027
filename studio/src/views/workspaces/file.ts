// SPDX-License-Identifier: Apache-2.0
// A workspace as a JSON file, which a program can ship.

import type { Workspace } from "../../control/shapes";
import { tr } from "../../language/text";

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
    throw new Error(tr("workspaces.theFileIsNotAWorkspace", { part: why instanceof Error ? why.message : String(why) }));
  }
  if (typeof said !== "object" || said === null || !("layout" in said)) throw new Error(tr("workspaces.theFileIsNotAWorkspaceIt"));
  const { workspace = FORMAT, ...rest } = said as { workspace?: unknown } & Workspace;
  if (workspace !== FORMAT) throw new Error(tr("workspaces.theFileHasVersionOfThe", { value: String(JSON.stringify(workspace)), FORMAT }));
  return rest;
}
