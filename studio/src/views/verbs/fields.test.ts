// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import {
  arrayOf,
  byField,
  degreesOf,
  elements,
  endText,
  gaps,
  isPosition,
  limitsAt,
  limitText,
  presentText,
  valueFrom,
  wrongText,
} from "./fields";

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

test("a present value is written as it could be entered", () => {
  expect([0.4, 0.1 + 0.2, true, "25 %", [1, 0.1 + 0.2], { x: 1 }].map(presentText)).toEqual([
    "0.4",
    "0.3",
    "true",
    "25 %",
    "[1,0.3]",
    '{"x":1}',
  ]);
  expect([null, undefined].map(presentText)).toEqual(["", ""]);
  expect(valueFrom(presentText([1, 0.5]), "double[2]")).toEqual([1, 0.5]);
});

test("an array is filled element by element", () => {
  expect(arrayOf(["1", "90 deg"], "double[n]")).toEqual([1, "90 deg"]);
  expect(arrayOf(["", ""], "double[n]")).toBeUndefined();
  expect(gaps(["1", ""])).toEqual([1]);
  expect(gaps(["", ""])).toEqual([]);
});

test("refusals are shown at the input that they name", () => {
  const refusals = [
    { class: "OutOfRange", message: "'goal' for 'arm.elbow' is 90 rad, but its range is -3 to 3 rad" },
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

test("what cannot be a value is refused with a sentence, and nothing else is", () => {
  expect(wrongText("1,5", "double")).toBe("'1,5' has a decimal comma: write 1.5");
  expect(wrongText("yes", "bool")).toContain("write true or false");
  expect(wrongText("[1, 2", "double[2]")).toContain("is neither a list");
  for (const fine of ["", "1.5", "90 deg", "[1, 2]", "30 %"]) expect(wrongText(fine, "double")).toBeNull();
});

test("a unit that is one or the other is a position as each of them is", () => {
  expect([isPosition("rad|m"), isPosition("rad"), isPosition("m"), isPosition("rad/s"), isPosition(null)]).toEqual([
    true,
    true,
    true,
    false,
    false,
  ]);
  expect(limitText(0.5, "rad|m")).toBe("0.5\u202frad or m");
});

test("angles are told in degrees beside what was written", () => {
  expect(degreesOf("1.5708", "rad")).toBe("90°");
  expect(degreesOf("90 deg", "rad|m")).toBe("1.571 rad");
  expect(degreesOf("1", "rad/s")).toBe("57.3°/s");
  expect([degreesOf("1", "m"), degreesOf("0.5", "rad|m"), degreesOf("", "rad"), degreesOf("1,5", "rad")]).toEqual(["", "", "", ""]);
  expect(endText(-2 * Math.PI, "rad")).toBe("-6.283 (-360°)");
  expect(endText(0.123456, "m")).toBe("0.1235");
  expect(endText(-2 * Math.PI, "rad|m")).toBe("-6.283");
});

test("limits that differ stand at their elements", () => {
  const bounds = { minimum: [-1, -2], maximum: [3] };
  expect([limitsAt(bounds, 0, "m"), limitsAt(bounds, 1, "m"), limitsAt({ minimum: [-1], maximum: [1] }, 0, "m")]).toEqual([
    "-1 to 3",
    "-2 to 3",
    "",
  ]);
});
