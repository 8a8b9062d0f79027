// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Button, Region } from "../../control/shapes";
import { buttonsText, panelOf, valuesText, type WrittenPanel } from "./written";

const EMPTY: WrittenPanel = { title: "", names: "", seconds: "10", values: "", device: "", verb: "", buttons: "" };

test("what a panel has is written as text, and read again as it was", () => {
  const values = [{ name: "level", label: "Level", minimum: 0, maximum: 2 }, { name: "flow" }, { name: "heat", maximum: 90 }];
  expect(valuesText(values)).toBe("level | Level | 0 | 2\nflow\nheat |  |  | 90");
  expect(panelOf("values", { ...EMPTY, values: valuesText(values) }, null)).toEqual({ panel: "values", values });
  const start = { verb: "fill", arguments: { level: { svv: "level" } } } as unknown as NonNullable<Button["start"]>;
  const buttons: Button[] = [
    { label: "Fill", instance: "fill#1", values: { to: 2 } },
    { label: "Empty", instance: "empty" },
    { label: "Own", start },
  ];
  expect(panelOf("buttons", { ...EMPTY, buttons: buttonsText(buttons) }, null)).toEqual({ panel: "buttons", buttons });
});

test("the share of a panel that is changed stays, and its heading goes where it is empty", () => {
  const before: Region = { panel: "plot", share: 2, title: "Old", names: ["a"] };
  const written = { ...EMPTY, names: " a \n\n b ", seconds: "5" };
  expect(panelOf("plot", written, before)).toEqual({ share: 2, panel: "plot", names: ["a", "b"], seconds: 5 });
});

test.each([
  ["plot", {}, "name at least one SVV to plot"],
  ["plot", { names: "a", seconds: "soon" }, "'soon' is not a number of seconds from 0.1 to 600"],
  ["values", { values: "level | Level | low" }, "the minimum of 'level' must be a number in the unit of the value, not 'low'"],
  ["values", { values: "a|b|1|2|3" }, "'a|b|1|2|3' has the wrong form: write NAME | label | minimum | maximum"],
  ["buttons", { buttons: "Fill" }, "'Fill' has the wrong form: write label: INSTANCE {\"input\": value}"],
  ["buttons", { buttons: "Fill: fill#1 {to: 2}" }, "the text after 'Fill' is not JSON: write {\"input\": value}"],
  ["scene", {}, "name the physical device to draw"],
  ["verb", {}, "name the verb whose state diagram to show"],
] as const)("a panel '%s' that is not written right says why", (kind, change, why) => {
  expect(panelOf(kind, { ...EMPTY, ...change }, null)).toBe(why);
});
