// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { completedName, freshName, namesIn, sizeText, sumOf } from "./begun";

test("a recording gets a plain name", () => {
  expect(freshName("cell one/two", new Date(2026, 10, 23, 5, 7, 9))).toBe("cell-one-two-20261123-050709.mcap");
});

test("a name is completed", () => {
  const names = ["run", " run ", "run.mcap", "run.", "run.MCAP", "run.v2", "", "  "];
  expect(names.map(completedName)).toEqual(["run.mcap", "run.mcap", "run.mcap", "run.mcap", "run.mcap", "run.v2.mcap", "", ""]);
});

test("names of SVVs, all where none is given", () => {
  expect(namesIn(" arm.*, force ")).toEqual(["arm.*", "force"]);
  expect(namesIn("  ")).toBeNull();
});

test("sizes and sums for people", () => {
  expect([0, 1023, 1024, 12_900_000].map(sizeText)).toEqual(["0 B", "1023 B", "1.0 KiB", "12.3 MiB"]);
  expect(sumOf({ a: 1, b: 2 })).toBe(3);
});
