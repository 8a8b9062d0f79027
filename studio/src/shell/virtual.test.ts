// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { LogEntry } from "../control/shapes";
import { isCondition, runAt, runUntil } from "./virtual";

const entry = (sequence: number, kind: string, text: string) =>
  ({ sequence, kind, text, about: "blink#1", time_s: 0, who: "" }) as LogEntry;

/** Returns a mock clock; each firing logs the entries of the next element of `firings`. */
function clockOf(firings: LogEntry[][]) {
  const log = [entry(3, "condition", "rose (reported by 'side')")];
  const asked: string[] = [];
  let at = 0;
  const clock = {
    async order(name: string, args: { duration_ns?: number }) {
      asked.push(args.duration_ns === undefined ? name : `${name} ${args.duration_ns > 0}`);
      if (name !== "step") return null;
      const next = firings[at];
      at += 1;
      log.push(...(next ?? []));
      return next !== undefined;
    },
    look: async (_: string, { since = 0 }: { since?: number }) => log.filter((one) => one.sequence >= since),
  };
  return { clock: clock as unknown as Parameters<typeof runUntil>[0], asked };
}

test("it stands behind the firing that reports the condition, and not at one of before", async () => {
  const firings = [[], [entry(4, "transition", "rose")], [entry(5, "condition", "fell")], [entry(6, "condition", "rose")], []];
  const { clock, asked } = clockOf(firings);
  expect((await runUntil(clock, "blink rose", new AbortController().signal))?.sequence).toBe(6);
  expect(asked).toEqual(["step", "step", "step", "step"]);
});

test("any condition, none where nothing happens any more, and none once it is held", async () => {
  expect((await runUntil(clockOf([[entry(4, "condition", "fell")]]).clock, "", new AbortController().signal))?.text).toBe("fell");
  expect(await runUntil(clockOf([[]]).clock, "rose", new AbortController().signal)).toBeNull();
  expect(await runUntil(clockOf([]).clock, "rose", AbortSignal.abort())).toBeNull();
  expect(isCondition(entry(1, "fault", "rose"), "rose")).toBe(false);
});

test("a clock that runs is moved until it is held", async () => {
  const { clock, asked } = clockOf([]);
  const over = new AbortController();
  const order = clock.order;
  clock.order = (async (...args: Parameters<typeof order>) => {
    if (asked.length === 2) over.abort();
    return await order(...args);
  }) as typeof order;
  await runAt(clock, () => 2, over.signal);
  expect(asked).toEqual(["advance true", "advance true", "advance true"]);
});
