// SPDX-License-Identifier: Apache-2.0
// Names of the numbers of one value: `[2]` of a `double[6]`, `.x` of a struct, nothing of a scalar.

/** The names of all numbers of a value of a type, in the order in which they come; of a type that is not understood `[0]`, `[1]` … */
export function componentNames(type_text: string, components: number): string[] {
  const named = read(tokens(type_text));
  if (named && named.length === components) return named;
  return components === 1 ? [""] : Array.from({ length: components }, (_, i) => `[${i}]`);
}

function tokens(text: string): string[] {
  return text.match(/\w+|[{}[\];]/g) ?? [];
}

function read(words: string[]): string[] | null {
  const names = typeAt(words);
  return words.length === 0 ? names : null;
}

// A type without its dimensions, then its dimensions: `double[3][2]`, `struct { double x; double q[4]; }[2]`.
function typeAt(words: string[]): string[] | null {
  const base = words.shift();
  if (base === undefined) return null;
  const inner = base === "struct" ? membersAt(words) : [""];
  return inner && dimensionsAt(words, inner);
}

function membersAt(words: string[]): string[] | null {
  if (words.shift() !== "{") return null;
  const names: string[] = [];
  while (words[0] !== "}") {
    const type = typeAt(words);
    const member = words.shift();
    if (!type || member === undefined) return null;
    const inner = dimensionsAt(words, type);
    if (!inner || words.shift() !== ";") return null;
    names.push(...inner.map((name) => `.${member}${name}`));
  }
  words.shift();
  return names;
}

function dimensionsAt(words: string[], inner: string[]): string[] | null {
  const counts: number[] = [];
  while (words[0] === "[") {
    const count = Number(words[1]);
    if (!Number.isInteger(count) || count < 1 || count > 4096 || words[2] !== "]") return null;
    counts.push(count);
    words.splice(0, 3);
  }
  let names = inner;
  for (const count of counts.reverse()) names = Array.from({ length: count }, (_, i) => names.map((name) => `[${i}]${name}`)).flat();
  return names;
}

/** A trace is one number of a channel, by name: `arm.force[2]` is `[2]` of `arm.force`. */
export function traceName(channel: string, component: string): string {
  return `${channel}${component}`;
}
