// SPDX-License-Identifier: Apache-2.0
// Pages of the docs for each view. They are part of the bundle and can be read offline.
import studio from "../../../docs/studio.md?raw";
import workspaces from "../../../docs/workspaces.md?raw";
import { type Block, blocksOf, sectionOf } from "./markdown";

const SECTIONS: Record<string, string[]> = {
  flow: ["Data flow, and the editor"],
  scope: ["The scope"],
  recordings: ["A recording in the same views"],
};

/** Names of the views' rows in the table of docs/studio.md. They are in English, whatever the language of the page. */
const ROWS: Record<string, string> = {
  start: "Start",
  system: "System",
  flow: "Data flow",
  verbs: "Verbs",
  devices: "Devices",
  scope: "Scope",
  log: "Log",
  recordings: "Recordings",
};

/** Returns the section of the docs about a view. */
export function helpOf(view: string): Block[] {
  if (view === "workspaces") return blocksOf(workspaces).slice(1);
  const page = blocksOf(studio);
  const shown = sectionOf(page, "What it shows");
  const table = shown.find((block) => block.kind === "table");
  const row = table?.kind === "table" ? table.rows.find(([name]) => name === `*${ROWS[view]}*`) : undefined;
  const about: Block[] = row?.[1] ? [{ kind: "text", text: row[1] }] : [];
  const sections = SECTIONS[view]?.flatMap((name) => sectionOf(page, name));
  return [...about, ...(sections ?? (row ? shown.filter((block) => block !== table) : shown))];
}
