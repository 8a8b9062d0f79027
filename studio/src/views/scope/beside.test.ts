// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { LogEntry } from "../../control/shapes";
import type { Past } from "../../control/source";
import { BEGINNING, momentsOf, nearest, shared, shiftOf } from "./beside";

const entry = (kind: string, time_s: number, about: string, text: string) => ({ kind, time_s, about, text }) as LogEntry;
const here = {
  begins_ns: 0,
  log: [
    entry("start", 1, "press#1", ""),
    entry("condition", 2, "press#1", "contact (reported by 'force')"),
    entry("transition", 2, "press#1", "command list 'hold' after 'approach'"),
    entry("condition", 5, "press#2", "contact (reported by 'force')"),
  ],
};
const there = {
  begins_ns: 3e9,
  log: [entry("condition", 7.25, "press#1", "contact (reported by 'force')"), entry("condition", 9, "press#1", "late")],
} as unknown as Past;

test("moments are conditions and starts, whatever the instance", () => {
  expect([...momentsOf(here)]).toEqual([
    [BEGINNING, [0]],
    ["press: start", [1e9]],
    ["press: contact", [2e9, 5e9]],
  ]);
  expect(shared(momentsOf(here), momentsOf(there))).toEqual([BEGINNING, "press: contact"]);
});

test("two runs are moved so that the moment is one", () => {
  expect(shiftOf(here, { past: there, moment: "press: contact", here: 1, there: 0 })).toBe(2.25e9);
  expect(shiftOf(here, { past: there, moment: BEGINNING, here: 0, there: 0 })).toBe(3e9);
});

test("the nearest of several times", () => {
  expect([nearest([1, 5, 9], 6), nearest([1, 5, 9], 100), nearest([4], -3)]).toEqual([1, 2, 0]);
});
