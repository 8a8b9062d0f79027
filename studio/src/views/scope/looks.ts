// SPDX-License-Identifier: Apache-2.0
// Looks of traces: eight colours that people with colour blindness can tell apart, and a line pattern for every further eight.

export const COLOURS = 8;
/** Dashes in pixels. */
export const PATTERNS: readonly (readonly number[])[] = [[], [8, 4], [2, 3], [8, 3, 2, 3], [14, 5], [5, 5], [8, 3, 2, 3, 2, 3], [3, 2]];

export function colourOf(look: number): string {
  return `--series-${(look % COLOURS) + 1}`;
}

// A second trace of a colour never has the same pattern as the first; neighbours differ in both.
export function patternOf(look: number): readonly number[] {
  return PATTERNS[Math.floor(look / COLOURS) % PATTERNS.length] ?? [];
}
