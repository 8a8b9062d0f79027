// SPDX-License-Identifier: Apache-2.0
// Numbers with units as the package reads them (crates/model/src/quantity.rs): "20 ms", "90 deg", "0.5 rad/s", "30 %". Invalid texts are
// refused with a message; nothing is guessed.

import { tr } from "../language/text";
/** Parsed value, or the reason why the text is invalid. */
export type ReadResult<T> = { value: T; wrong?: undefined } | { value?: undefined; wrong: string };

/** Exponents of m, kg, s, A, K, rad, counts and pixels. */
type Dimension = readonly [number, number, number, number, number, number, number, number];

interface Unit {
  multiply: number;
  divide: number;
  dimension: Dimension;
}

const NONE: Dimension = [0, 0, 0, 0, 0, 0, 0, 0];
const TIME: Dimension = [0, 0, 1, 0, 0, 0, 0, 0];
const ANGLE: Dimension = [0, 0, 0, 0, 0, 1, 0, 0];

/** Factor, divisor and dimension of each symbol, and whether it accepts prefixes. */
const SYMBOLS: Record<string, readonly [number, number, Dimension, boolean]> = {
  m: [1, 1, [1, 0, 0, 0, 0, 0, 0, 0], true],
  g: [1, 1000, [0, 1, 0, 0, 0, 0, 0, 0], true],
  s: [1, 1, TIME, true],
  A: [1, 1, [0, 0, 0, 1, 0, 0, 0, 0], true],
  K: [1, 1, [0, 0, 0, 0, 1, 0, 0, 0], true],
  rad: [1, 1, ANGLE, true],
  deg: [Math.PI, 180, ANGLE, false],
  "°": [Math.PI, 180, ANGLE, false],
  rev: [2 * Math.PI, 1, ANGLE, false],
  rpm: [2 * Math.PI, 60, [0, 0, -1, 0, 0, 1, 0, 0], false],
  Hz: [1, 1, [0, 0, -1, 0, 0, 0, 0, 0], true],
  N: [1, 1, [1, 1, -2, 0, 0, 0, 0, 0], true],
  J: [1, 1, [2, 1, -2, 0, 0, 0, 0, 0], true],
  W: [1, 1, [2, 1, -3, 0, 0, 0, 0, 0], true],
  Pa: [1, 1, [-1, 1, -2, 0, 0, 0, 0, 0], true],
  bar: [100_000, 1, [-1, 1, -2, 0, 0, 0, 0, 0], true],
  V: [1, 1, [2, 1, -3, -1, 0, 0, 0, 0], true],
  Ohm: [1, 1, [2, 1, -3, -2, 0, 0, 0, 0], true],
  Ω: [1, 1, [2, 1, -3, -2, 0, 0, 0, 0], true],
  min: [60, 1, TIME, false],
  h: [3600, 1, TIME, false],
  C: [1, 1, [0, 0, 1, 1, 0, 0, 0, 0], true],
  F: [1, 1, [-2, -1, 4, 2, 0, 0, 0, 0], true],
  H: [1, 1, [2, 1, -2, -2, 0, 0, 0, 0], true],
  T: [1, 1, [0, 1, -2, -1, 0, 0, 0, 0], true],
  Wb: [1, 1, [2, 1, -2, -1, 0, 0, 0, 0], true],
  l: [1, 1000, [3, 0, 0, 0, 0, 0, 0, 0], true],
  L: [1, 1000, [3, 0, 0, 0, 0, 0, 0, 0], true],
  counts: [1, 1, [0, 0, 0, 0, 0, 0, 1, 0], false],
  count: [1, 1, [0, 0, 0, 0, 0, 0, 1, 0], false],
  px: [1, 1, [0, 0, 0, 0, 0, 0, 0, 1], false],
  "%": [1, 100, NONE, false],
  "1": [1, 1, NONE, false],
};

const PREFIXES: Record<string, readonly [number, number]> = {
  n: [1, 1e9],
  u: [1, 1e6],
  µ: [1, 1e6],
  μ: [1, 1e6],
  m: [1, 1e3],
  c: [1, 1e2],
  d: [1, 1e1],
  k: [1e3, 1],
  M: [1e6, 1],
  G: [1e9, 1],
};

const NUMBER = /^([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)$/s;
const COMMA = /^\s*[+-]?\d+,\d+/;

/** Returns an error message if the text contains a number with a decimal comma, otherwise null. Lists in brackets may contain commas. */
export function commaIn(text: string): string | null {
  const found = COMMA.exec(text);
  return found ? tr("design.textHasADecimalCommaWrite", { text: text.trim(), value: found[0].trim().replace(",", ".") }) : null;
}

/**
 * Converts text to a number in a unit; a number without a unit is returned unchanged. For a choice such as `rad|m`, the first unit of
 * the same dimension is used.
 */
export function numberIn(text: string, target: string): ReadResult<number> {
  const read = split(text);
  if (read.wrong !== undefined) return read;
  const [number, symbol] = read.value;
  if (symbol === "" || symbol === target) return { value: number };
  const given = unitOf(symbol);
  if (!given) return { wrong: tr("design.textHasTheUnknownUnitSymbol", { text: text.trim(), symbol }) };
  const wanted: Unit | undefined =
    target === ""
      ? { multiply: 1, divide: 1, dimension: given.dimension }
      : target
          .split("|")
          .map(unitOf)
          .find((unit) => unit !== null && isSame(unit.dimension, given.dimension)) || undefined;
  if (!wanted) return { wrong: tr("design.textIsNotAQuantityIn", { text: text.trim(), target }) };
  return { value: (number * given.multiply * wanted.divide) / (given.divide * wanted.multiply) };
}

/**
 * Converts "20 ms", "1.5 s", "2 min" or the period of a rate, "1 kHz", to whole nanoseconds. `bare` is the unit of a number without a
 * unit.
 */
export function durationNs(text: string, bare: "s" | null = null): ReadResult<number> {
  const read = split(text);
  if (read.wrong !== undefined) return read;
  const [number, symbol] = read.value;
  if (symbol === "") {
    if (bare === null) return { wrong: tr("design.textHasNoUnitWrite20", { text: text.trim() }) };
    return inRange(number * 1e9, text);
  }
  const time = numberIn(text, "ns");
  if (time.wrong === undefined) return inRange(time.value, text);
  const rate = numberIn(text, "Hz");
  if (rate.wrong === undefined && rate.value > 0) return inRange(1e9 / rate.value, text);
  return { wrong: tr("design.textIsNotATimeWrite", { text: text.trim() }) };
}

function inRange(ns: number, text: string): ReadResult<number> {
  return Math.abs(ns) < 2 ** 63 ? { value: Math.round(ns) } : { wrong: tr("design.textIsOutOfRange", { text: text.trim() }) };
}

function split(text: string): ReadResult<[number, string]> {
  const comma = commaIn(text);
  if (comma !== null) return { wrong: comma };
  const found = NUMBER.exec(text.trim());
  const number = Number(found?.[1]);
  if (!found || !Number.isFinite(number)) return { wrong: tr("design.textIsNotANumberWith", { text: text.trim() }) };
  return { value: [number, found[2] ?? ""] };
}

function isSame(one: Dimension, other: Dimension): boolean {
  return one.every((exponent, at) => exponent === other[at]);
}

/** Parses a unit: `kg.m^2/s`, `N*m`, `m/s2`, `1/s`. All factors after a slash are in the denominator. Returns null for an unknown unit. */
function unitOf(text: string): Unit | null {
  let [multiply, divide] = [1, 1];
  const dimension = [0, 0, 0, 0, 0, 0, 0, 0];
  for (const [at, part] of text.split("/").entries()) {
    for (const word of part.split(/[.*· ]/).filter(Boolean)) {
      const found = /^(.*?)(?:(²)|\^?(-?\d+))?$/s.exec(word);
      const symbol = word === "1" ? "1" : (found?.[1] ?? "");
      const written = word === "1" ? 1 : found?.[2] ? 2 : Number(found?.[3] ?? 1);
      const unit = symbolOf(symbol);
      if (!unit || Math.abs(written) > 9) return null;
      const exponent = at === 0 ? written : -written;
      for (let times = 0; times < Math.abs(exponent); times += 1) {
        multiply *= exponent > 0 ? unit.multiply : unit.divide;
        divide *= exponent > 0 ? unit.divide : unit.multiply;
      }
      for (const [index, one] of unit.dimension.entries()) dimension[index] = (dimension[index] ?? 0) + one * exponent;
    }
  }
  return { multiply, divide, dimension: dimension as unknown as Dimension };
}

function symbolOf(symbol: string): Unit | null {
  const known = Object.hasOwn(SYMBOLS, symbol) ? SYMBOLS[symbol] : undefined;
  if (known) return { multiply: known[0], divide: known[1], dimension: known[2] };
  for (const [prefix, [up, down]] of Object.entries(PREFIXES)) {
    const rest = symbol.slice(prefix.length);
    const of = symbol.startsWith(prefix) && Object.hasOwn(SYMBOLS, rest) ? SYMBOLS[rest] : undefined;
    if (of?.[3]) return { multiply: of[0] * up, divide: of[1] * down, dimension: of[2] };
  }
  return null;
}
