// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { happenedTo, lastTransition } from "./happened";

const entries = [
  { sequence: 0, time_s: 0, kind: "start", about: "move#1", text: "", who: "" },
  { sequence: 1, time_s: 0.1, kind: "condition", about: "move#1", text: "'generator' reported 'in_velocity'", who: "" },
  { sequence: 2, time_s: 0.2, kind: "condition", about: "move#1", text: "'generator' reported 'in_velocity'", who: "" },
  { sequence: 3, time_s: 0.2, kind: "start", about: "move#2", text: "", who: "" },
  { sequence: 4, time_s: 0.3, kind: "transition", about: "move#1", text: "command list 'stop' after 'start'", who: "" },
];

test("what happened to an instance, newest first, repeats counted", () => {
  const found = happenedTo("move#1", entries);
  expect(found.map((entry) => [entry.kind, entry.times])).toEqual([
    ["transition", 1],
    ["condition", 2],
    ["start", 1],
  ]);
});

test("the transition that was made last, since the last start", () => {
  expect(lastTransition(happenedTo("move#1", entries))).toEqual({ from: "start", to: "stop" });
  expect(lastTransition(happenedTo("move#2", entries))).toBeNull();
  const on = [
    ...entries,
    { sequence: 5, time_s: 0.4, kind: "transition", about: "move#1", text: "command list 'rest' after 'stop'", who: "" },
  ];
  expect(lastTransition(happenedTo("move#1", on))).toEqual({ from: "stop", to: "rest" });
});
