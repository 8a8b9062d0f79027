// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { arrayOf, byField, elements, gaps, limitText, valueFrom } from "./fields";

test("the number of elements of an input", () => {
  expect(elements("double", 6)).toBeNull();
  expect(elements("double[3]", 6)).toBe(3);
  expect(elements("double[n]", 6)).toBe(6);
  expect(elements("double[n]", 0)).toBe(1);
});

test("what is written becomes a value; text with a unit is the system's to read", () => {
  expect(valueFrom(" 1.5 ", "double")).toBe(1.5);
  expect(valueFrom("1e-3", "double")).toBe(0.001);
  expect(valueFrom("90 deg", "double")).toBe("90 deg");
  expect(valueFrom("true", "bool")).toBe(true);
  expect(valueFrom("[1, 2]", "double[2]")).toEqual([1, 2]);
  expect(valueFrom("[1, 2", "double[2]")).toBe("[1, 2");
  expect(valueFrom("", "double")).toBeUndefined();
});

test("an array is filled element by element", () => {
  expect(arrayOf(["1", "90 deg"], "double[n]")).toEqual([1, "90 deg"]);
  expect(arrayOf(["", ""], "double[n]")).toBeUndefined();
  expect(gaps(["1", ""])).toEqual([1]);
  expect(gaps(["", ""])).toEqual([]);
});

test("refusals are shown at the input that they name", () => {
  const refusals = [
    { class: "OutOfRange", message: "'goal' for 'arm.elbow' is 90 rad and its range is -3 to 3 rad" },
    { class: "NotEnabled", message: "'arm.elbow' is disabled" },
  ];
  const { of, rest } = byField(refusals, ["goal", "speed"]);
  expect(of.get("goal")).toEqual([refusals[0]]);
  expect(rest).toEqual([refusals[1]]);
});

test("limits are told with their unit", () => {
  expect(limitText(Math.PI, "rad")).toBe("3.14159\u202frad");
  expect(limitText("arm.max_speed", "rad/s")).toBe("arm.max_speed");
  expect(limitText(null, "rad")).toBe("");
});
