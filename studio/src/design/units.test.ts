// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { unitsAgree, unitText } from "./units";

test("a unit that is a choice is read as one", () => {
  expect([unitText("rad|m"), unitText("N.m|N"), unitText("s"), unitText(""), unitText(null)]).toEqual([
    "rad or m",
    "N.m or N",
    "s",
    "",
    "",
  ]);
});

test("units agree where one choice of each is the same, or nobody says", () => {
  expect([unitsAgree("rad|m", "m"), unitsAgree("rad", "rad|m"), unitsAgree("", "N"), unitsAgree("rad|m", "N")]).toEqual([
    true,
    true,
    true,
    false,
  ]);
});
