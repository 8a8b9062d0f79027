// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { InstalledInstance } from "../../../control/shapes";
import { inOwnUnits, unitOf } from "./units";

/** Returns a joint's servo whose position has these units; its error is a private cell. */
function servo(...units: string[]): InstalledInstance {
  const port = (unit: string, cell: string | null) => ({ name: "p", unit, cell });
  const cell = (name: string, unit: string) => ({ name, unit });
  const ports = [
    ...units.map((_, index) => port("rad|m", `position ${index}`)),
    port("N.m|N", null),
    port("rad|m", "error"),
    port("s", null),
  ];
  return {
    blocks: [{ ports }],
    cells: [...units.map((unit, index) => cell(`position ${index}`, unit)), cell("error", "rad|m"), cell("time", "s")],
  } as unknown as InstalledInstance;
}

const units = (of: InstalledInstance) => [of.blocks[0]?.ports.map((port) => port.unit), of.cells.map((cell) => cell.unit)];

test("a servo of a sliding joint reads m and N everywhere, one of a turning joint rad and N.m", () => {
  expect(units(inOwnUnits(servo("m")))).toEqual([
    ["m", "N", "m", "s"],
    ["m", "m", "s"],
  ]);
  expect(units(inOwnUnits(servo("rad")))).toEqual([
    ["rad", "N.m", "rad", "s"],
    ["rad", "rad", "s"],
  ]);
  expect(unitOf(servo("m"), "rad/s|m/s")).toBe("m/s");
});

test("where joints of both kinds are meant, or none, the choice stays", () => {
  const mixed = servo("m", "rad");
  expect(inOwnUnits(mixed)).toBe(mixed);
  expect(unitOf(mixed, "rad|m")).toBe("rad|m");
});
