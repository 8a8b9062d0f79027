// SPDX-License-Identifier: Apache-2.0
// Interrupt sources have colours, so that one sees which block runs where.

const SERIES = 8;
const given = new Map<string, number>();

/** The colour of a source, the same as long as the page is open; a line's where there is none. */
export function sourceColour(source: string | null): string {
  if (source === null) return "var(--line-strong)";
  const known = given.get(source) ?? given.size;
  given.set(source, known);
  return `var(--series-${(known % SERIES) + 1})`;
}
