// SPDX-License-Identifier: Apache-2.0
import { type ExportedChannel, missingText, rows, secondsText } from "./table";

/** Number of rows in each part of the file. */
const PART_ROWS = 4096;

/**
 * Formats the values as CSV, in parts: `time_s`, then a column for each component, empty if its channel has no value at that time.
 * Numbers are written in full precision. Missing values are listed first, in lines that begin with `#` (pandas: `comment="#"`).
 */
export function* csv(channels: readonly ExportedChannel[], from_ns: number, to_ns: number): Generator<string> {
  const missing = missingText(channels, from_ns, to_ns);
  yield [...missing.map((line) => `# ${line}`), heading(channels), ""].join("\n");
  let lines: string[] = [];
  const parts: string[] = [];
  rows(channels, from_ns, to_ns, (time_ns, indices) => {
    const cells = [secondsText(time_ns)];
    channels.forEach(({ ring, components }, i) => {
      const at = indices[i] as number | null;
      for (const { index } of components) cells.push(at === null ? "" : String(ring.value(at, index)));
    });
    lines.push(cells.join(","));
    if (lines.length < PART_ROWS) return;
    parts.push(`${lines.join("\n")}\n`);
    lines = [];
  });
  yield* parts;
  if (lines.length > 0) yield `${lines.join("\n")}\n`;
}

function heading(channels: readonly ExportedChannel[]): string {
  const names = channels.flatMap(({ name, unit, components }) =>
    components.map((component) => `${name}${component.name}${unit ? ` (${unit})` : ""}`),
  );
  return ["time_s", ...names.map(quoted)].join(",");
}

function quoted(text: string): string {
  return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}
