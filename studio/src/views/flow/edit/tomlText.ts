// SPDX-License-Identifier: Apache-2.0
// Locations of the values in a TOML text: parses enough of the language to find each key with its value in any context.

/** A value in the text: its span, and the text to be deleted together with it. */
export interface Spot {
  /** Start of the value. */
  from: number;
  to: number;
  /** Start of the key. */
  key_from: number;
  /** True if the value is in an inline table or array, between commas. */
  isInline: boolean;
  /** For an inline table, the position at which a further key is inserted, and whether the table is empty. */
  room: { at: number; isEmpty: boolean } | null;
}

/** A table with a header: the position of the header, and the position at which a line is added. */
export interface Section {
  path: readonly string[];
  heading: number;
  at: number;
}

/** An array of tables, each with its own header, `[[verbs.swing.transitions]]`. Its tables are sections, numbered from 0. */
export interface Tables {
  /** The header, exactly as in the text. */
  heading: string;
  count: number;
}

export interface Map_ {
  spots: ReadonlyMap<string, Spot>;
  sections: ReadonlyMap<string, Section>;
  arrays: ReadonlyMap<string, Tables>;
}

/** Returns the key that represents a path in the maps. */
export function pathKey(path: readonly string[]): string {
  return JSON.stringify(path);
}

/** Locates every key in a valid TOML text; returns null if the text contains unsupported syntax. */
export function mapOf(text: string): Map_ | null {
  try {
    return new Scanner(text).all();
  } catch (why) {
    if (why instanceof Unknown) return null;
    throw why;
  }
}

class Unknown extends Error {}

class Scanner {
  readonly #text: string;
  readonly #spots = new Map<string, Spot>();
  readonly #sections = new Map<string, Section>();
  readonly #arrays = new Map<string, Tables>();
  #at = 0;

  constructor(text: string) {
    this.#text = text;
  }

  all(): Map_ {
    let table: string[] = [];
    let heading = 0;
    this.#sections.set(pathKey([]), { path: [], heading, at: 0 });
    for (this.#blank(); this.#at < this.#text.length; this.#blank()) {
      if (this.#text.startsWith("[[", this.#at)) {
        heading = this.#at;
        this.#at += 2;
        table = this.#element(this.#path());
        this.#expect("]");
        this.#expect("]");
        this.#sections.set(pathKey(table), { path: table, heading, at: this.#lineEnd() });
        const array = this.#arrays.get(pathKey(table.slice(0, -1)));
        if (array) array.heading = this.#text.slice(heading, this.#at);
      } else if (this.#text[this.#at] === "[") {
        heading = this.#at;
        this.#at += 1;
        table = this.#inArrays(this.#path());
        this.#expect("]");
        this.#sections.set(pathKey(table), { path: table, heading, at: this.#lineEnd() });
      } else {
        this.#pair(table, false);
        this.#sections.set(pathKey(table), { path: table, heading, at: this.#lineEnd() });
      }
    }
    return { spots: this.#spots, sections: this.#sections, arrays: this.#arrays };
  }

  /** Returns the path of the next table of an array. */
  #element(written: string[]): string[] {
    const last = written.at(-1) as string;
    const path = [...this.#inArrays(written.slice(0, -1)), last];
    const array = this.#arrays.get(pathKey(path)) ?? { heading: "", count: 0 };
    array.count += 1;
    this.#arrays.set(pathKey(path), array);
    return [...path, String(array.count - 1)];
  }

  /** Returns the path of a header; below an array of tables, it belongs to the last table. */
  #inArrays(written: readonly string[]): string[] {
    const path: string[] = [];
    for (const key of written) {
      path.push(key);
      const array = this.#arrays.get(pathKey(path));
      if (array) path.push(String(array.count - 1));
    }
    return path;
  }

  /** Parses `key = value`. */
  #pair(table: readonly string[], isInline: boolean): void {
    const key_from = this.#at;
    const path = [...table, ...this.#path()];
    this.#expect("=");
    this.#space();
    const from = this.#at;
    const room = this.#value(path);
    this.#spots.set(pathKey(path), { from, to: this.#at, key_from, isInline, room });
  }

  #value(path: readonly string[]): Spot["room"] {
    const first = this.#text[this.#at];
    if (first === "{") return this.#inlineTable(path);
    if (first === "[") this.#array(path);
    else if (first === '"' || first === "'") this.#string();
    else {
      const bare = /^[^\s,\]}#]+/.exec(this.#text.slice(this.#at, this.#at + 64));
      if (!bare) throw new Unknown();
      this.#at += bare[0].length;
    }
    return null;
  }

  #inlineTable(path: readonly string[]): Spot["room"] {
    this.#at += 1;
    let at = this.#at;
    let isEmpty = true;
    for (this.#blank(); this.#text[this.#at] !== "}"; this.#blank()) {
      if (this.#text[this.#at] === ",") {
        this.#at += 1;
        continue;
      }
      this.#pair(path, true);
      at = this.#at;
      isEmpty = false;
    }
    this.#at += 1;
    return { at, isEmpty };
  }

  /** Parses an array; its items are numbered from 0. */
  #array(path: readonly string[]): void {
    this.#at += 1;
    let number = 0;
    for (this.#blank(); this.#text[this.#at] !== "]"; this.#blank()) {
      if (this.#text[this.#at] === ",") {
        this.#at += 1;
        continue;
      }
      const [from, own] = [this.#at, [...path, String(number)]];
      const room = this.#value(own);
      this.#spots.set(pathKey(own), { from, to: this.#at, key_from: from, isInline: true, room });
      number += 1;
    }
    this.#at += 1;
  }

  #string(): void {
    const quote = this.#text[this.#at] as string;
    const end = this.#text.startsWith(quote.repeat(3), this.#at) ? quote.repeat(3) : quote;
    for (this.#at += end.length; !this.#text.startsWith(end, this.#at); this.#at += 1) {
      if (this.#at >= this.#text.length) throw new Unknown();
      if (this.#text[this.#at] === "\\" && quote === '"') this.#at += 1;
    }
    this.#at += end.length;
    // A triple-quoted string may end with up to two more quotes.
    while (end.length === 3 && this.#text[this.#at] === quote) this.#at += 1;
  }

  #path(): string[] {
    const path: string[] = [];
    for (;;) {
      this.#space();
      const from = this.#at;
      const quote = this.#text[from];
      if (quote === '"' || quote === "'") {
        this.#string();
        const written = this.#text.slice(from, this.#at);
        path.push(quote === '"' ? (JSON.parse(written) as string) : written.slice(1, -1));
      } else {
        const bare = /^[A-Za-z0-9_-]+/.exec(this.#text.slice(from, from + 200));
        if (!bare) throw new Unknown();
        this.#at += bare[0].length;
        path.push(bare[0]);
      }
      this.#space();
      if (this.#text[this.#at] !== ".") return path;
      this.#at += 1;
    }
  }

  #expect(letter: string): void {
    this.#space();
    if (this.#text[this.#at] !== letter) throw new Unknown();
    this.#at += 1;
  }

  #space(): void {
    while (this.#text[this.#at] === " " || this.#text[this.#at] === "\t") this.#at += 1;
  }

  /** Skips whitespace, line ends and comments. */
  #blank(): void {
    const between = /[ \t\r\n]*(#[^\n]*)?/y;
    for (;;) {
      between.lastIndex = this.#at;
      const found = between.exec(this.#text)?.[0] ?? "";
      if (found === "") return;
      this.#at += found.length;
    }
  }

  /** Returns the start of the next line. */
  #lineEnd(): number {
    const end = this.#text.indexOf("\n", this.#at);
    return end < 0 ? this.#text.length : end + 1;
  }
}
