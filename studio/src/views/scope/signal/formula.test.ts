// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { combined } from "./derived";
import { formula } from "./formula";
import type { Series } from "./series";

const computed = (text: string, ...of: number[]) => formula(text).value(of);

test("precedence, signs, brackets, functions and constants", () => {
  expect(computed("a + 2 * b", 1, 3)).toBe(7);
  expect(computed("(a + 2) * b / 3", 1, 3)).toBe(3);
  expect(computed("-a^2", 3)).toBe(-9);
  expect(computed("2^-a^2", 1)).toBe(0.5);
  expect(computed("a - 1 - 1", 5)).toBe(3);
  expect(computed("hypot(a, b) + maximum(a, b, 9) - abs(-a)", 3, 4)).toBe(11);
  expect(computed("sin(pi * a)", 0.5)).toBeCloseTo(1);
  expect(computed("1.5e-3 * a + .5", 1000)).toBe(2);
});

test("names are those of traces, each once", () => {
  expect(formula("arm.force[0]^2 + move#1:gain * arm.force[0] - q.left[1].x").names).toEqual([
    "arm.force[0]",
    "move#1:gain",
    "q.left[1].x",
  ]);
});

test("what cannot be read is refused with its place", () => {
  const refused = (text: string, why: string) => expect(() => formula(text)).toThrow(why);
  refused("a +", "at its end: a number, a trace or '(' was expected");
  refused("a b", "at 'b': an operator was expected");
  refused("(a", "')' was expected");
  refused("a $ 2", "invalid at '$ 2'");
  refused("sine(a)", "this function is unknown; use one of abs, sqrt");
  refused("atan2(a)", "it takes 2 arguments");
  refused("2 * 3", "does not name a trace");
  refused("", "at its end");
});

test("series are combined at the times of the first one, with what the others hold then", () => {
  const series = (times: number[], values: number[]): Series => [
    { times_ns: Float64Array.from(times), values: Float64Array.from(values), from: 0, to: times.length, broken: false },
  ];
  const { value } = formula("a * b + a");
  const made = combined([series([0, 10, 20], [1, 2, 3]), series([5, 20], [10, 100])], value);
  expect(made.flatMap((piece) => [...piece.times_ns])).toEqual([10, 20]);
  expect(made.flatMap((piece) => [...piece.values])).toEqual([22, 303]);
});
