// SPDX-License-Identifier: Apache-2.0
import { type Draft, definitionOf, draftOf, FORMAT, VERSION } from "./definition";

/** The text of a file with one definition: what `gpac.load` reads. */
export function fileText(draft: Draft): string {
  const definition: Record<string, unknown> = { ...definitionOf(draft), layout: draft.of.layout };
  const name = draft.of.name;
  delete definition.name;
  return `${JSON.stringify({ format: FORMAT, version: VERSION, [`${draft.kind}s`]: { [name]: definition } }, null, 2)}\n`;
}

/** Every graph and verb of a file. Errors: what it is instead, in words. */
export function draftsOf(text: string): Draft[] {
  let read: unknown;
  try {
    read = JSON.parse(text);
  } catch (why) {
    const toml = /^\s*format\s*=/m.test(text);
    const remedy = toml ? `: it is TOML; make it JSON with gpac.load("FILE.toml") and .save("FILE.json")` : `: ${String(why)}`;
    throw new Error(`this is no JSON file${remedy}`);
  }
  const file = read as { format?: unknown; version?: unknown; graphs?: Record<string, unknown>; verbs?: Record<string, unknown> };
  if (file.format !== FORMAT)
    throw new Error(`this is no file of definitions: its format is ${JSON.stringify(file.format)}, not "${FORMAT}"`);
  if (file.version !== VERSION)
    throw new Error(`the file has version ${JSON.stringify(file.version)}; this studio knows version ${VERSION}`);
  const graphs = file.graphs ?? {};
  return [
    ...Object.entries(file.verbs ?? {}).map(([name, written]) => draftOf("verb", name, written, graphs)),
    ...Object.entries(graphs).map(([name, written]) => draftOf("graph", name, written, graphs)),
  ];
}

/** Hands a text to the person as a file. */
export function download(name: string, text: string): void {
  const address = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  // The browser has taken it by then.
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
