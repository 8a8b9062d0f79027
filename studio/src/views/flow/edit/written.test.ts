// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { constantOf, givenOf } from "./written";

test("a constant may have its unit; which one goes is the system's to say", () => {
  expect(constantOf("3 Hz", "double")).toEqual({ value: "3 Hz", wrong: null });
  expect(constantOf("-1.5e-3 N.m/rad", "double").value).toBe("-1.5e-3 N.m/rad");
  expect(constantOf("90deg", "double").value).toBe("90deg");
  expect(givenOf("20 ms").value).toBe("20 ms");
  expect(givenOf("25 %").value).toBe("25 %");
  expect(constantOf("3", "double").value).toBe(3);
  expect(constantOf("1, 2", "double[2]").value).toEqual([1, 2]);
});

test("what is neither a number nor a quantity is refused, with what can be written", () => {
  expect(constantOf("fast", "double").wrong).toContain("'fast' is not a double");
  expect(constantOf("3 Hz", "bool").wrong).toContain("'3 Hz' is not a bool");
});
