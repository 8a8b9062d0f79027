// SPDX-License-Identifier: Apache-2.0
// Colours of interrupt sources, which show where each block runs.

const SERIES = 8;
const given = new Map<string, number>();

/** Returns the colour of a source, which does not change as long as the page is open. For null, returns the colour of lines. */
export function sourceColour(source: string | null): string {
  if (source === null) return "var(--line-strong)";
  const known = given.get(source) ?? given.size;
  given.set(source, known);
  return `var(--series-${(known % SERIES) + 1})`;
}
