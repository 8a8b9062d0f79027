// SPDX-License-Identifier: Apache-2.0
import { expect, test, vi } from "vitest";
import { RefusalError, unreachable } from "../refusals";
import type { InstalledInstances, ReplayDifference, Replaying } from "../shapes";
import { differsOf, ReplayRun } from "./replaying";

const DIFFERENCE: ReplayDifference = {
  source: "rtp0.fast",
  number: 42,
  time_ns: 42_000_000,
  between: false,
  block: "counts#1.counter",
  port: "y",
  svv: "",
  type_text: "double",
  recorded: ["42.0"],
  replayed: ["42.5"],
  how: "",
  stored: [],
};
const INSTALLED = [
  { instances: [{ name: "counts#1", blocks: [{ label: "counter", ports: [{ name: "y", cell: "counts#1:count" }] }] }] },
] as unknown as InstalledInstances[];

test("a difference names signal, place and both values", () => {
  expect(differsOf(DIFFERENCE, INSTALLED)).toEqual({
    time_ns: 42_000_000,
    where: "block 'counts#1.counter', output 'y', in firing 42 of source 'rtp0.fast'",
    signal: "counts#1:count",
    recorded: "42",
    replayed: "42.5",
  });
  expect(differsOf({ ...DIFFERENCE, svv: "count" }, []).signal).toBe("count");
  const unknown = differsOf({ ...DIFFERENCE, block: "", port: "", recorded: [], replayed: [], how: "other values" }, []);
  expect(unknown).toMatchObject({ signal: null, recorded: "–", where: "in firing 42 of source 'rtp0.fast': other values" });
});

const still = { running: true, firings: 10, time_ns: 5, found: null, failure: null } as Replaying;
const found = (difference: ReplayDifference | null) =>
  ({
    ...still,
    running: false,
    found: { stopped: difference ? "difference" : "end", firings: 50, message: "", difference, time_ns: 42_000_000 },
  }) as unknown as Replaying;

/** Returns a mock system that reports these states of its replay, one after another. */
function system(...looks: (Replaying | Error)[]) {
  const asked: string[] = [];
  const look = vi.fn(async () => {
    const next = looks.length > 1 ? looks.shift() : looks[0];
    if (next instanceof Error) throw next;
    return next;
  });
  const aside = vi.fn(async (name: string) => {
    asked.push(name);
    return { replay: 7 };
  });
  return { asked, of: new ReplayRun({ look, aside } as never, "run.mcap", () => INSTALLED) };
}

test("a replay is looked at until it is over, and its first difference is kept", async () => {
  vi.useFakeTimers();
  const { asked, of } = system(still, still, found(DIFFERENCE));
  const done = of.run(true);
  await vi.advanceTimersByTimeAsync(100);
  expect(of.state.get()).toEqual({ kind: "runs", firings: 10, time_ns: 5 });
  await vi.runAllTimersAsync();
  await done;
  expect(of.state.get()).toMatchObject({ kind: "over", firings: 50, isWhole: false });
  expect(of.differs.get()?.signal).toBe("counts#1:count");
  expect(asked).toEqual(["replay", "stop_replay"]);
  vi.useRealTimers();
});

test("equal runs say so, what fails says why, and what was cancelled says nothing", async () => {
  const equal = system(found(null));
  await equal.of.run(false);
  expect(equal.of.state.get()).toMatchObject({ kind: "over", isWhole: true, differs: null });
  const failed = system({ ...still, running: false, failure: "'run.mcap' brings native code" });
  await failed.of.run(false);
  expect(failed.of.state.get()).toMatchObject({ kind: "failed", refusals: [{ message: "'run.mcap' brings native code" }] });
  vi.useFakeTimers();
  const gone = new RefusalError([{ class: "UnknownName", message: "there is no replay 7" }], 422);
  const cancelled = system(still, gone);
  const done = cancelled.of.run(false);
  await vi.advanceTimersByTimeAsync(50);
  await cancelled.of.cancel();
  await vi.runAllTimersAsync();
  await done;
  expect(cancelled.of.state.get()).toEqual({ kind: "none" });
  vi.useRealTimers();
});

test("a replay goes on if the system does not answer for a while", async () => {
  vi.useFakeTimers();
  const slow = new RefusalError([{ class: "LimitExceeded", message: "it took too long" }], 408);
  const { of, asked } = system(still, slow, unreachable(new Error("cut")), still, found(null));
  const over = of.run(false);
  await vi.advanceTimersByTimeAsync(10_000);
  await over;
  vi.useRealTimers();
  expect(of.state.get()).toMatchObject({ kind: "over", firings: 50 });
  expect(asked).toEqual(["replay", "stop_replay"]);
});
