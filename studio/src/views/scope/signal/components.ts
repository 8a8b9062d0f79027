// SPDX-License-Identifier: Apache-2.0
// Names of the components of one value: `[2]` of a `double[6]`, `.x` of a struct, an empty name for a scalar.

/** Returns the names of the components of a type, in order; `[0]`, `[1]` … for an unsupported type. */
export function componentNames(type_text: string, components: number): string[] {
  const numbers = read(tokens(type_text));
  if (numbers && numbers.length === components) return numbers.map(({ name }) => name);
  return components === 1 ? [""] : Array.from({ length: components }, (_, i) => `[${i}]`);
}

/** Returns for each component whether it is a C Boolean. */
export function truthValues(type_text: string, components: number): boolean[] {
  const numbers = read(tokens(type_text));
  return Array.from({ length: components }, (_, i) => numbers?.length === components && numbers[i]?.scalar === "bool");
}

/** A component of a value: its name and its C type. */
interface Component {
  name: string;
  scalar: string;
}

function tokens(text: string): string[] {
  return text.match(/\w+|[{}[\];]/g) ?? [];
}

function read(words: string[]): Component[] | null {
  const numbers = typeAt(words);
  return words.length === 0 ? numbers : null;
}

// Parses a type without its dimensions, then its dimensions: `double[3][2]`, `struct { double x; double q[4]; }[2]`.
function typeAt(words: string[]): Component[] | null {
  const base = words.shift();
  if (base === undefined) return null;
  const inner = base === "struct" ? membersAt(words) : [{ name: "", scalar: base }];
  return inner && dimensionsAt(words, inner);
}

function membersAt(words: string[]): Component[] | null {
  if (words.shift() !== "{") return null;
  const numbers: Component[] = [];
  while (words[0] !== "}") {
    const type = typeAt(words);
    const member = words.shift();
    if (!type || member === undefined) return null;
    const inner = dimensionsAt(words, type);
    if (!inner || words.shift() !== ";") return null;
    numbers.push(...inner.map(({ name, scalar }) => ({ name: `.${member}${name}`, scalar })));
  }
  words.shift();
  return numbers;
}

function dimensionsAt(words: string[], inner: Component[]): Component[] | null {
  const counts: number[] = [];
  while (words[0] === "[") {
    const count = Number(words[1]);
    if (!Number.isInteger(count) || count < 1 || count > 4096 || words[2] !== "]") return null;
    counts.push(count);
    words.splice(0, 3);
  }
  let numbers = inner;
  for (const count of counts.reverse()) {
    const each = numbers;
    numbers = Array.from({ length: count }, (_, i) => each.map(({ name, scalar }) => ({ name: `[${i}]${name}`, scalar }))).flat();
  }
  return numbers;
}

/** Returns the name of a trace, which is one component of a channel: `arm.force[2]` is `[2]` of `arm.force`. */
export function traceName(channel: string, component: string): string {
  return `${channel}${component}`;
}
