// SPDX-License-Identifier: Apache-2.0
import { parse as parseToml, TomlError } from "smol-toml";
import { type Draft, definitionOf, draftOf, FORMAT, VERSION } from "./definition";

/** The text of a file with one definition: what `gpac.load` reads. */
export function fileText(draft: Draft): string {
  const definition: Record<string, unknown> = { ...definitionOf(draft), layout: draft.of.layout };
  const name = draft.of.name;
  delete definition.name;
  return `${JSON.stringify({ format: FORMAT, version: VERSION, [`${draft.kind}s`]: { [name]: definition } }, null, 2)}\n`;
}

/** What the text of a file says, JSON or TOML. */
function readText(text: string): unknown {
  if (text.trimStart().startsWith("{")) {
    try {
      return JSON.parse(text);
    } catch (why) {
      throw new Error(`the JSON of this file is broken: ${why instanceof Error ? why.message : String(why)}`);
    }
  }
  try {
    return parseToml(text);
  } catch (why) {
    if (!(why instanceof TomlError)) throw why;
    throw new Error(`this is neither JSON nor TOML: line ${why.line}, column ${why.column}: ${why.message.split("\n")[0]}`);
  }
}

/** Every graph and verb of a file. Errors: what it is instead, in words. */
export function draftsOf(text: string): Draft[] {
  const file = readText(text) as { format?: unknown; version?: unknown; graphs?: Record<string, unknown>; verbs?: Record<string, unknown> };
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
