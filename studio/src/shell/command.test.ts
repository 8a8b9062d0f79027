// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { personOf } from "../control/command";
import type { Holder } from "../control/shapes";
import { settledOf, wordsOf } from "./CommandRequests";

type SettledRequest = Holder["settled"][number];

const settled = (number: number, name: string, outcome: SettledRequest["outcome"], by: string | null, reason = ""): SettledRequest => ({
  number,
  name,
  outcome,
  by,
  reason,
});

const state = (...of: SettledRequest[]): Holder => ({ holder: "panel", who: "token x", person: null, requests: [], settled: of });

test("a page is told once what became of its last request, unless it took it back itself", () => {
  const told = state(settled(1, "us", "declined", "panel", "not now"), settled(2, "them", "granted", "panel"));
  expect(settledOf(told, "us", 0)?.number).toBe(1);
  expect(settledOf(told, "us", 1)).toBeNull();
  expect(settledOf(told, "nobody", 0)).toBeNull();
  expect(settledOf(state(settled(3, "us", "withdrawn", "us")), "us", 0)).toBeNull();
});

test("each end of a request is one sentence, with who and why", () => {
  expect(wordsOf(settled(1, "us", "declined", "panel", "not now"))).toBe("The request for command was declined by panel: not now.");
  expect(wordsOf(settled(1, "us", "timed_out", null, "session 'panel' did not answer in time"))).toContain("Nobody answered");
  expect(wordsOf(settled(1, "us", "granted", "panel"))).toBe("Command was granted to this page.");
});

test("a session is told by its person, or else by its caller", () => {
  expect(personOf({ who: "token x", person: "Anna" })).toBe("Anna");
  expect(personOf({ who: "token x", person: null })).toBe("token x");
});
