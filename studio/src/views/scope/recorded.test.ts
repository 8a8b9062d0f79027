// SPDX-License-Identifier: Apache-2.0
import { expect, test, vi } from "vitest";
import { AGAIN_MS } from "../../control/asking";
import { RefusalError } from "../../control/refusals";
import type { RecordedSpan } from "../../control/shapes";
import type { Differs, Past } from "../../control/source";
import { WatchedValue } from "../../control/watched";
import type { ToWorker } from "./messages";
import { RecordedFeed, runsOf } from "./recorded";

const CHANNELS = [{ name: "q", type_text: "double[2]", unit: "rad", components: 2 }];

/** Returns two values of two components each, as the system packs them. */
function packed(): string {
  const view = new DataView(new ArrayBuffer(2 * 16 + 4 * 8));
  const times = [1_000_000n, 2n ** 52n];
  times.forEach((time, at) => {
    view.setBigInt64(16 * at, time, true);
    view.setBigUint64(16 * at + 8, BigInt(at + 7), true);
  });
  for (const [at, value] of [0.1, -0.2, Number.NaN, 1e300].entries()) view.setFloat64(32 + 8 * at, value, true);
  return btoa(String.fromCharCode(...new Uint8Array(view.buffer)));
}

test("values come with their bits, times and numbers", () => {
  const [run] = runsOf({ channels: [{ samples: packed(), sums: [] }] }, CHANNELS);
  expect([...(run?.times_ns ?? [])]).toEqual([1_000_000, 2 ** 52]);
  expect([...(run?.numbers ?? [])]).toEqual([7, 8]);
  expect([...(run?.values ?? [])]).toEqual([0.1, -0.2, Number.NaN, 1e300]);
});

function pastOf(asked: string[][]): Past {
  const empty: RecordedSpan = { channels: [{ samples: "", sums: [] }], next: null };
  return {
    name: "run.mcap",
    log: [],
    begins_ns: 0,
    ends_ns: 1e9,
    cursor: new WatchedValue(0),
    differs: new WatchedValue<Differs | null>(null),
    go: () => undefined,
    channel: (name) => CHANNELS.find((channel) => channel.name === name),
    others: async () => ["run.mcap"],
    beside: () => Promise.reject(new Error("there is no other")),
    async *span(names, from_ns, to_ns, columns) {
      asked.push([names.join(), String(from_ns), String(to_ns), String(columns)]);
      yield { ...empty, next: 4 };
      yield empty;
    },
  };
}

test("a span that was not answered is asked for again, until another one is wanted", async () => {
  vi.useFakeTimers();
  const refused = new RefusalError([{ class: "LimitExceeded", message: "full" }], 429);
  const answers: (Error | null)[] = [refused, null, refused];
  const asked: string[][] = [];
  const there = pastOf([]);
  const past: Past = {
    ...there,
    async *span(names, from_ns, to_ns, columns, signal) {
      asked.push([String(from_ns), String(to_ns)]);
      const why = answers.shift();
      if (why) throw why;
      yield* there.span(names, from_ns, to_ns, columns, signal);
    },
  };
  const failed: string[] = [];
  const feed = new RecordedFeed(past, vi.fn(), (why) => failed.push(why));
  feed.want(["q"]);
  feed.look({ from_ns: 0, to_ns: 100, columns: 10 });
  await vi.advanceTimersByTimeAsync(10 * AGAIN_MS);
  expect(failed).toEqual(["full", ""]);
  feed.look({ from_ns: 0, to_ns: 50, columns: 10 });
  await vi.advanceTimersByTimeAsync(0);
  feed.end();
  await vi.advanceTimersByTimeAsync(10 * AGAIN_MS);
  vi.useRealTimers();
  expect(asked).toEqual([
    ["0", "100"],
    ["0", "100"],
    ["0", "50"],
  ]);
});

test("each other look is asked for once, and what was not recorded is told", async () => {
  const asked: string[][] = [];
  const said: ToWorker[] = [];
  let done = 0;
  const over = new Promise<void>((ended) => {
    const feed = new RecordedFeed(
      pastOf(asked),
      (message) => said.push(message),
      () => {
        done += 1;
        ended();
      },
    );
    feed.want(["q", "missing"]);
    feed.look({ from_ns: 0, to_ns: 100, columns: 10 });
    feed.look({ from_ns: 0, to_ns: 100, columns: 10 });
    expect([...feed.refused.get().keys()]).toEqual(["missing"]);
  });
  await over;
  expect(done).toBe(1);
  expect(asked).toEqual([["q", "0", "100", "10"]]);
  expect(said.map((message) => message.kind === "past" && message.begins)).toEqual([true, false]);
});
