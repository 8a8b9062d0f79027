// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { End, LogEntry } from "../../control/shapes";
import { asCsv, asJsonLines, kindsOf, linesOf, shownLines } from "./lines";

const entry = (sequence: number, time_s: number, kind: string, about: string, text = ""): LogEntry => ({
  sequence,
  time_s,
  kind,
  about,
  text,
  who: "",
});

const log = {
  entries: [
    entry(0, 1, "start", "move#1"),
    entry(1, 1.1, "condition", "move#1", "'near' reported 'done'"),
    entry(2, 1.2, "condition", "move#1", "'near' reported 'done'"),
    { ...entry(3, 2.5, "command", "move#1", "halt"), who: "studio-abcd" },
  ],
  dropped: 0,
  earlier: [],
};
const ends = {
  entries: [
    {
      number: 0,
      instance: 7,
      report: {
        instance: "move#1",
        verb: "move",
        start: 1,
        condition: "arrived",
        normal: true,
        command_list: "start",
        time_s: 2,
        started_s: 1,
        message: "",
        block: null,
        value: null,
        outputs: { error: 0.5 },
        others: [],
        way: [],
      },
    } satisfies End,
  ],
  dropped: 0,
  earlier: [],
};

const none = { hidden: new Set<string>(), text: "" };

test("entries and reports come in the order of their times", () => {
  expect(linesOf(log, ends).map((line) => line.key)).toEqual(["e0", "e1", "e2", "r0", "e3"]);
  expect(linesOf(null, ends).map((line) => line.key)).toEqual(["r0"]);
});

test("what repeats is one line with its count, its first and last time", () => {
  const shown = shownLines(linesOf(log, ends), none);
  expect(shown.map((line) => line.times)).toEqual([1, 2, 1, 1]);
  expect([shown[1]?.first_s, shown[1]?.time_s]).toEqual([1.1, 1.2]);
});

test("kinds can be hidden, and all words must be there, who commanded among them", () => {
  const lines = linesOf(log, ends);
  expect(shownLines(lines, { ...none, hidden: new Set(["condition"]) }).map((line) => line.kind)).toEqual(["start", "report", "command"]);
  expect(shownLines(lines, { ...none, text: "studio HALT" }).map((line) => line.key)).toEqual(["e3"]);
  expect(kindsOf(lines).get("condition")).toBe(2);
});

test("exports keep every figure, and quote what needs it", () => {
  const lines = shownLines(linesOf(log, ends), none);
  expect(asCsv([{ ...(lines[0] as (typeof lines)[0]), text: 'a "b", c' }]).split("\r\n")[1]).toBe('1,start,move#1,"a ""b"", c",,1,present');
  expect(JSON.parse(asJsonLines(lines).split("\n")[2] ?? "").report.outputs).toEqual({ error: 0.5 });
});

test("what is of an earlier run comes first, says so, and counts for nothing that is present", () => {
  const before = { entries: [], dropped: 0, earlier: [entry(7, 40, "condition", "move#1", "'near' reported 'done'")] };
  const now = { entries: [entry(0, 1.2, "condition", "move#1", "'near' reported 'done'")], dropped: 0, earlier: before.earlier };
  const shown = shownLines(linesOf(now, null), none);
  expect(shown.map((line) => [line.key, line.isEarlier, line.times])).toEqual([
    ["b0", true, 1],
    ["e0", false, 1],
  ]);
  expect(
    asCsv(shown)
      .split("\r\n")
      .slice(1, 3)
      .map((row) => row.split(",").at(-1)),
  ).toEqual(["earlier", "present"]);
});

test("the presses of a jog button are a line of each kind, and what happens between them keeps its place", () => {
  const press = (number: number) => [
    { ...entry(10 * number, number, "command", `jog#${number}`, "start"), who: "studio-abcd" },
    entry(10 * number + 1, number + 0.1, "start", `jog#${number}`),
    { ...entry(10 * number + 2, number + 0.2, "command", `jog#${number}`, "halt"), who: "studio-abcd" },
  ];
  const presses = [1, 2, 3].flatMap(press);
  const shown = shownLines(linesOf({ entries: presses, dropped: 0, earlier: [] }, null), none);
  expect(shown.map(({ kind, text, times, first_s, time_s }) => [kind, text, times, first_s, time_s])).toEqual([
    ["command", "start", 3, 1, 3],
    ["start", "", 3, 1.1, 3.1],
    ["command", "halt", 3, 1.2, 3.2],
  ]);
  const entries = [...presses, entry(50, 5, "fault", "move#1", "divided by 0"), ...press(6), entry(70, 7, "fault", "jog#6", "late")];
  const kinds = shownLines(linesOf({ entries, dropped: 0, earlier: [] }, null), none).map((line) => line.kind);
  expect(kinds).toEqual(["command", "start", "command", "fault", "command", "start", "command", "fault"]);
  // Other verbs have a line for each start.
  const moves = [1, 2].flatMap((number) => [
    entry(number, number, "start", `move#${number}`),
    entry(number + 4, number, "transition", `move#${number}`),
  ]);
  expect(shownLines(linesOf({ entries: moves, dropped: 0, earlier: [] }, null), none)).toHaveLength(4);
});
