// SPDX-License-Identifier: Apache-2.0
// Formulas over traces: `sqrt(arm.force[0]^2 + arm.force[1]^2) - 5`.

import { tr } from "../../../language/text";
/** A parsed formula. */
export interface Formula {
  /** Names of the traces in the formula, without duplicates, in the order of first occurrence. */
  names: readonly string[];
  /** Computes the formula from values of these traces, in order. */
  value: (of: readonly number[]) => number;
}

const FUNCTIONS: Record<string, { arguments: [number, number]; of: (...values: number[]) => number }> = {
  abs: { arguments: [1, 1], of: Math.abs },
  sqrt: { arguments: [1, 1], of: Math.sqrt },
  exp: { arguments: [1, 1], of: Math.exp },
  log: { arguments: [1, 1], of: Math.log },
  sin: { arguments: [1, 1], of: Math.sin },
  cos: { arguments: [1, 1], of: Math.cos },
  tan: { arguments: [1, 1], of: Math.tan },
  atan2: { arguments: [2, 2], of: Math.atan2 },
  hypot: { arguments: [1, 16], of: Math.hypot },
  minimum: { arguments: [1, 16], of: Math.min },
  maximum: { arguments: [1, 16], of: Math.max },
};
const CONSTANTS: Record<string, number> = { pi: Math.PI };
const SYMBOL = /\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([A-Za-z_][\w.#:]*(?:\[\d+\](?:\.\w+)*)*)|([-+*/^(),]))/y;

interface Symbol_ {
  kind: "number" | "name" | "sign" | "end";
  text: string;
  at: number;
}

/**
 * Parses a formula: numbers, names of traces, + − * / ^, parentheses, functions. Throws an `Error` with the position of the mistake and
 * the reason.
 */
export function formula(text: string): Formula {
  return new Parser(text).whole();
}

type Part = (of: readonly number[]) => number;

class Parser {
  readonly #symbols: Symbol_[];
  readonly #names: string[] = [];
  #next = 0;

  constructor(text: string) {
    this.#symbols = symbolsOf(text);
  }

  whole(): Formula {
    const value = this.#sum();
    const rest = this.#peek();
    if (rest.kind !== "end") throw wrong(rest, tr("scope.anOperatorWasExpected"));
    if (this.#names.length === 0) throw new Error(tr("scope.theFormulaDoesNotNameA"));
    return { names: this.#names, value };
  }

  #sum(): Part {
    let left = this.#product();
    for (;;) {
      const [one, sign] = [left, this.#take("+", "-")];
      if (sign === null) return left;
      const other = this.#product();
      left = sign === "+" ? (of) => one(of) + other(of) : (of) => one(of) - other(of);
    }
  }

  #product(): Part {
    let left = this.#signed();
    for (;;) {
      const [one, sign] = [left, this.#take("*", "/")];
      if (sign === null) return left;
      const other = this.#signed();
      left = sign === "*" ? (of) => one(of) * other(of) : (of) => one(of) / other(of);
    }
  }

  // A sign binds less tightly than a power: -x^2 is -(x^2).
  #signed(): Part {
    const sign = this.#take("-", "+");
    if (sign === null) return this.#power();
    const of = this.#signed();
    return sign === "-" ? (values) => -of(values) : of;
  }

  #power(): Part {
    const base = this.#single();
    if (this.#take("^") === null) return base;
    const exponent = this.#signed();
    return (of) => base(of) ** exponent(of);
  }

  #single(): Part {
    const symbol = this.#peek();
    this.#next += 1;
    if (symbol.kind === "number") {
      const value = Number(symbol.text);
      return () => value;
    }
    if (symbol.kind === "name") return this.#named(symbol);
    if (symbol.text !== "(") throw wrong(symbol, tr("scope.aNumberATraceOrWas"));
    const inner = this.#sum();
    this.#close();
    return inner;
  }

  #named(symbol: Symbol_): Part {
    if (this.#peek().text === "(") return this.#call(symbol);
    const constant = CONSTANTS[symbol.text];
    if (constant !== undefined) return () => constant;
    let index = this.#names.indexOf(symbol.text);
    if (index < 0) index = this.#names.push(symbol.text) - 1;
    return (of) => of[index] as number;
  }

  #call(symbol: Symbol_): Part {
    const known = FUNCTIONS[symbol.text];
    if (!known) throw wrong(symbol, tr("scope.thisFunctionIsUnknownUseOne", { value: Object.keys(FUNCTIONS).join(", ") }));
    this.#next += 1;
    const given = [this.#sum()];
    while (this.#take(",") !== null) given.push(this.#sum());
    this.#close();
    const [least, most] = known.arguments;
    if (given.length < least || given.length > most)
      throw wrong(
        symbol,
        tr("scope.itTakesArguments", { count: most, part: least === most ? least : tr("scope.leastToMost", { least, most }) }),
      );
    return (of) => known.of(...given.map((one) => one(of)));
  }

  #close(): void {
    if (this.#take(")") === null) throw wrong(this.#peek(), tr("scope.wasExpected"));
  }

  #peek(): Symbol_ {
    return this.#symbols[this.#next] as Symbol_;
  }

  #take(...signs: string[]): string | null {
    const { kind, text } = this.#peek();
    if (kind !== "sign" || !signs.includes(text)) return null;
    this.#next += 1;
    return text;
  }
}

function symbolsOf(text: string): Symbol_[] {
  const found: Symbol_[] = [];
  let at = 0;
  const end = text.trimEnd().length;
  while (at < end) {
    SYMBOL.lastIndex = at;
    const match = SYMBOL.exec(text);
    if (!match) throw new Error(tr("scope.theFormulaIsInvalidAt", { value: text.slice(at).trim() }));
    const [whole, number, name, sign] = match;
    const kind = number !== undefined ? "number" : name !== undefined ? "name" : "sign";
    found.push({ kind, text: number ?? name ?? sign ?? "", at });
    at += whole.length;
  }
  return [...found, { kind: "end", text: "", at: end }];
}

function wrong(symbol: Symbol_, why: string): Error {
  return new Error(tr("scope.theFormulaIsInvalidAtWhy", { part: symbol.kind === "end" ? tr("scope.itsEnd") : `'${symbol.text}'`, why }));
}
