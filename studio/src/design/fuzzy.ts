// SPDX-License-Identifier: Apache-2.0

/**
 * Returns how well `typed` matches `name` (higher is better), or null if it does not match. The name must contain all letters in order.
 * Letters at the beginning of a word and adjacent letters score higher, and short names rank first: `shse` finds `shoulder.sensed`.
 */
export function score(typed: string, name: string): number | null {
  const letters = typed.toLowerCase().replaceAll(/\s+/g, "");
  const text = name.toLowerCase();
  if (letters === "") return 0;
  const best = bestFrom(letters, text, 0, 0, new Map());
  return best === null ? null : best - text.length / 100;
}

const BEGIN = 8;
const NEXT = 5;
const ANY = 1;

function bestFrom(letters: string, text: string, letter: number, from: number, known: Map<number, number | null>): number | null {
  if (letter === letters.length) return 0;
  const key = letter * 1024 + from;
  const before = known.get(key);
  if (before !== undefined) return before;
  let best: number | null = null;
  for (let at = text.indexOf(letters[letter] as string, from); at >= 0; at = text.indexOf(letters[letter] as string, at + 1)) {
    const rest = bestFrom(letters, text, letter + 1, at + 1, known);
    if (rest === null) break;
    const begins = at === 0 || /[^a-z0-9]/.test(text[at - 1] as string);
    const gain = (at === from && letter > 0 ? NEXT : begins ? BEGIN : ANY) + rest;
    if (best === null || gain > best) best = gain;
  }
  known.set(key, best);
  return best;
}

/** Returns at most `most` names that match `typed`, best first; if nothing is typed, the first names in their order. */
export function found(typed: string, names: readonly string[], most: number): string[] {
  if (typed.trim() === "") return names.slice(0, most);
  return names
    .map((name) => ({ name, score: score(typed, name) }))
    .filter((one): one is { name: string; score: number } => one.score !== null)
    .sort((a, b) => b.score - a.score || a.name.localeCompare(b.name, undefined, { numeric: true }))
    .slice(0, most)
    .map((one) => one.name);
}
