// SPDX-License-Identifier: Apache-2.0
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { AGAIN_MS } from "../asking";
import type { Control } from "../control";
import { RefusalError } from "../refusals";
import { Recording } from "./recording";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

/** Opens a recording of one second in a system that fails at each question for the values at the cursor; `asked` are their times, ms. */
async function faulty(): Promise<{ recording: Recording; asked: number[] }> {
  const asked: number[] = [];
  const begins_ms = Date.now();
  const look = async (call: string) => {
    if (call === "recorded") return { begins_ns: 0, ends_ns: 1e9, channels: [], metadata: {}, system: "cell", clock: "real" };
    if (call === "recorded_messages") return { messages: [], next: null };
    asked.push(Date.now() - begins_ms);
    throw new RefusalError([{ class: "InvalidState", message: "internal error" }], 500);
  };
  const recording = await Recording.open({ look } as unknown as Control, "run.mcap");
  await vi.advanceTimersByTimeAsync(0);
  return { recording, asked };
}

test("another position of the cursor is asked for at the intervals of a new question", async () => {
  const { recording, asked } = await faulty();
  await vi.advanceTimersByTimeAsync(3 * AGAIN_MS);
  expect(asked).toEqual([0, AGAIN_MS, 3 * AGAIN_MS]);
  recording.go(5e8);
  await vi.advanceTimersByTimeAsync(AGAIN_MS);
  expect(asked.slice(3)).toEqual([3 * AGAIN_MS, 4 * AGAIN_MS]);
});

test("a recording that was left asks nothing more", async () => {
  const { recording, asked } = await faulty();
  recording.leave();
  recording.go(5e8);
  await vi.advanceTimersByTimeAsync(100 * AGAIN_MS);
  expect(asked).toEqual([0]);
  expect(vi.getTimerCount()).toBe(0);
});
