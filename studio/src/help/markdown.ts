// SPDX-License-Identifier: Apache-2.0
// Blocks and spans of the docs' Markdown that the help shows: without images and comments.

/** Block element of a page. */
export type Block =
  | { kind: "heading"; level: number; text: string }
  | { kind: "text"; text: string }
  | { kind: "list"; items: string[] }
  | { kind: "table"; head: string[]; rows: string[][] }
  | { kind: "code"; text: string };

/** Inline span of a line. A link to another page of the docs is reduced to its text, because the help shows only one page. */
export interface Span {
  kind: "plain" | "code" | "strong" | "emphasis";
  text: string;
}

/** Parses a page of the docs into block elements. */
export function blocksOf(page: string): Block[] {
  const lines = page.replace(/<!--[\s\S]*?-->/g, "").split("\n");
  const blocks: Block[] = [];
  for (let at = 0; at < lines.length; ) {
    const line = lines[at] ?? "";
    const heading = /^(#+)\s+(.*)$/.exec(line);
    if (heading) {
      blocks.push({ kind: "heading", level: heading[1]?.length ?? 1, text: heading[2] ?? "" });
      at += 1;
    } else if (line.startsWith("```")) {
      const end = lines.findIndex((one, index) => index > at && one.startsWith("```"));
      blocks.push({ kind: "code", text: lines.slice(at + 1, end < 0 ? undefined : end).join("\n") });
      at = end < 0 ? lines.length : end + 1;
    } else if (line.startsWith("|")) {
      const rows = lines.slice(
        at,
        endOf(lines, at, (one) => one.startsWith("|")),
      );
      const [head = [], , ...body] = rows.map(cellsOf);
      blocks.push({ kind: "table", head, rows: body });
      at += rows.length;
    } else if (/^- /.test(line)) {
      const rows = lines.slice(
        at,
        endOf(lines, at, (one) => /^(- | {2,}\S)/.test(one)),
      );
      const items: string[] = [];
      for (const row of rows) {
        if (row.startsWith("- ")) items.push(row.slice(2));
        else items.push(`${items.pop() ?? ""} ${row.trim()}`);
      }
      blocks.push({ kind: "list", items });
      at += rows.length;
    } else if (line.trim() === "" || line.startsWith("![")) {
      at += 1;
    } else {
      const rows = lines.slice(
        at,
        endOf(lines, at, (one) => one.trim() !== "" && !/^([#|]|```|- |!\[)/.test(one)),
      );
      const text = rows.length === 0 ? line : rows.join(" ");
      blocks.push({ kind: "text", text });
      at += Math.max(1, rows.length);
    }
  }
  return blocks;
}

function endOf(lines: string[], from: number, goesOn: (line: string) => boolean): number {
  let at = from;
  while (at < lines.length && goesOn(lines[at] ?? "")) at += 1;
  return at;
}

function cellsOf(row: string): string[] {
  const cells = row
    .trim()
    .replace(/^\||\|$/g, "")
    .split(/(?<!\\)\|/);
  return cells.map((cell) => cell.trim().replaceAll("\\|", "|"));
}

/** Splits a line into inline spans. */
export function spansOf(text: string): Span[] {
  const spans: Span[] = [];
  const found = text.replace(/\[([^\]]*)\]\([^)]*\)/g, "$1").matchAll(/`([^`]+)`|\*\*([^*]+)\*\*|\*([^*\s][^*]*)\*|([^`*]+|[`*])/g);
  for (const [, code, strong, emphasis, plain] of found) {
    const before = spans.at(-1);
    if (code !== undefined) spans.push({ kind: "code", text: code });
    else if (strong !== undefined) spans.push({ kind: "strong", text: strong });
    else if (emphasis !== undefined) spans.push({ kind: "emphasis", text: emphasis });
    else if (before?.kind === "plain") before.text += plain ?? "";
    else spans.push({ kind: "plain", text: plain ?? "" });
  }
  return spans;
}

/** Returns the section under a heading, without the heading, up to the next heading of the same level. */
export function sectionOf(blocks: Block[], title: string): Block[] {
  const from = blocks.findIndex((block) => block.kind === "heading" && block.text === title);
  const heading = blocks[from];
  if (heading?.kind !== "heading") return [];
  const next = blocks.findIndex((block, index) => index > from && block.kind === "heading" && block.level <= heading.level);
  return blocks.slice(from + 1, next < 0 ? undefined : next);
}
