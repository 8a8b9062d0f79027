// SPDX-License-Identifier: Apache-2.0
// Styles of traces: eight colours that colour-blind people can distinguish, and a line pattern for every further eight.

export const COLOURS = 8;
/** Dash patterns of lines, px. */
export const PATTERNS: readonly (readonly number[])[] = [[], [8, 4], [2, 3], [8, 3, 2, 3], [14, 5], [5, 5], [8, 3, 2, 3, 2, 3], [3, 2]];

export function colourOf(look: number): string {
  return `--series-${(look % COLOURS) + 1}`;
}

// Traces of equal colour have different patterns, and neighbouring looks differ in colour.
export function patternOf(look: number): readonly number[] {
  return PATTERNS[Math.floor(look / COLOURS) % PATTERNS.length] ?? [];
}
