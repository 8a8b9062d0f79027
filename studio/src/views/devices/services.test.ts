// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { DriverOption, DriverService } from "../../control/shapes";
import { answerText, argumentFrom, argumentsOfService } from "./services";

const option = (name: string, kind: string, unit = "", fallback: string | null = null): DriverOption => ({
  name,
  kind,
  unit,
  default: fallback,
  doc: "",
});

test.each([
  [option("address", "whole"), "7", 7],
  [option("address", "whole"), "0x6040", 0x6040],
  [option("timeout", "number", "s"), "20 ms", 0.02],
  [option("timeout", "number", "s"), "2", 2],
  [option("on", "bool"), "false", false],
  [option("line", "text"), " as it is ", " as it is "],
  [option("values", "list"), "[1, 2]", [1, 2]],
  [option("map", "table"), '{"a": 1}', { a: 1 }],
  [option("id", "whole", "", "1"), "", undefined],
])("an argument is what its kind says", (of, text, value) => {
  expect(argumentFrom(text, of)).toEqual({ value });
});

test.each([
  [option("address", "whole"), "", "enter a value"],
  [option("address", "whole"), "1.5", "not an integer"],
  [option("timeout", "number", "s"), "1,5 s", "write 1.5"],
  [option("timeout", "number", "s"), "3 N", "the dimensions differ"],
  [option("on", "bool"), "yes", "choose true or false"],
  [option("values", "list"), "1, 2", "not a list"],
  [option("map", "table"), "[1]", "not a table"],
])("what cannot be one is refused with a sentence", (of, text, why) => {
  expect(argumentFrom(text, of).wrong).toContain(why);
});

test("a service gets what was written, and what is wrong stands at its argument", () => {
  const service: DriverService = {
    name: "read",
    doc: "",
    answer: "whole",
    moves: false,
    arguments: [option("address", "whole"), option("n", "whole", "", "1")],
  };
  expect(argumentsOfService(service, { address: "7" })).toEqual({ given: { address: 7 }, wrong: {} });
  expect(argumentsOfService(service, {})).toEqual({ given: {}, wrong: { address: "enter a value" } });
});

test("an answer in words", () => {
  expect(answerText(null)).toBe("done");
  expect(answerText(7)).toBe("7");
  expect(
    answerText([
      { id: 1, model: "sts3215" },
      { id: 2, model: "sts3215" },
    ]),
  ).toBe("{id 1, model sts3215}\n{id 2, model sts3215}");
});
