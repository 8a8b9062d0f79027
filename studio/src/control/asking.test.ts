// SPDX-License-Identifier: Apache-2.0
import { readdirSync, readFileSync } from "node:fs";
import path from "node:path";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { AGAIN_MS, askUntilAnswered } from "./asking";
import { RefusalError, unreachable } from "./refusals";
import { WatchedValue } from "./watched";

const system = { restarts: new WatchedValue(0) };

beforeEach(() => {
  vi.useFakeTimers();
});

afterEach(() => {
  vi.useRealTimers();
});

const refused = (status: number) => new RefusalError([{ class: "LimitExceeded", message: `status ${status}` }], status);

test.each([
  ["a lost connection", unreachable(new Error("cut"))],
  ["a lack of capacity", refused(429)],
  ["a request that took too long", refused(408)],
  ["a fault of the system", refused(500)],
])("after %s, a question is asked again until it is answered", async (_, why) => {
  const ask = vi.fn<() => Promise<string>>().mockRejectedValueOnce(why).mockRejectedValueOnce(why).mockResolvedValue("two active writers");
  const [take, failed] = [vi.fn(), vi.fn()];
  askUntilAnswered(system, { ask, take, failed });
  await vi.advanceTimersByTimeAsync(2 * AGAIN_MS);
  expect(failed.mock.calls).toEqual([[why], [why]]);
  expect(take.mock.calls).toEqual([["two active writers"]]);
  await vi.advanceTimersByTimeAsync(10 * AGAIN_MS);
  expect(ask).toHaveBeenCalledTimes(3);
});

test("a refusal is an answer", async () => {
  const ask = vi.fn<() => Promise<string>>().mockRejectedValue(refused(404));
  const failed = vi.fn();
  askUntilAnswered(system, { ask, take: vi.fn(), failed });
  await vi.advanceTimersByTimeAsync(10 * AGAIN_MS);
  expect(ask).toHaveBeenCalledTimes(1);
  expect(failed).toHaveBeenCalledTimes(1);
});

test("a withdrawn question takes neither an answer nor a failure, and is not asked again", async () => {
  const [take, failed] = [vi.fn(), vi.fn()];
  // Answered at the instant at which it is withdrawn: the answer has arrived, but not yet been taken.
  askUntilAnswered(system, { ask: () => Promise.resolve("old"), take, failed })();
  askUntilAnswered(system, { ask: () => Promise.reject(refused(429)), take, failed })();
  const never = vi.fn<() => Promise<string>>().mockResolvedValue("too late");
  askUntilAnswered(system, { ask: never, take, failed, after_ms: 250 })();
  const again = vi.fn<() => Promise<string>>().mockRejectedValue(refused(429));
  const withdraw = askUntilAnswered(system, { ask: again, take, failed });
  await vi.advanceTimersByTimeAsync(0);
  expect(failed).toHaveBeenCalledTimes(1);
  withdraw();
  await vi.advanceTimersByTimeAsync(10 * AGAIN_MS);
  expect(again).toHaveBeenCalledTimes(1);
  expect(never).not.toHaveBeenCalled();
  expect(take).not.toHaveBeenCalled();
  expect(failed).toHaveBeenCalledTimes(1);
});

test("a restarted system is asked again, and the answer of its previous run is not taken", async () => {
  const answers: ((answer: string) => void)[] = [];
  const take = vi.fn();
  const withdraw = askUntilAnswered(system, { ask: () => new Promise<string>((answer) => answers.push(answer)), take });
  answers[0]?.("first");
  await vi.advanceTimersByTimeAsync(0);
  system.restarts.set(1);
  system.restarts.set(2);
  expect(answers).toHaveLength(3);
  for (const [index, answer] of answers.entries()) answer(`run ${index}`);
  await vi.advanceTimersByTimeAsync(0);
  expect(take.mock.calls).toEqual([["first"], ["run 2"]]);
  withdraw();
  system.restarts.set(3);
  expect(answers).toHaveLength(3);
});

/** Effects that ask the system once and keep the answer without `askUntilAnswered`, and the reason. */
const EXCEPTIONS: Record<string, string> = {
  "views/devices/arms.ts": "the arms are read again every second",
  "views/recordings/Files.tsx": "the list of files is read again every two seconds",
  "views/verbs/index.tsx": "the list of verbs is read again every two seconds",
};

test("every effect that keeps an answer of the system asks until it is answered", () => {
  const source = path.resolve(import.meta.dirname, "..");
  const files = readdirSync(source, { recursive: true, encoding: "utf8" }).filter((file) => /(?<!\.test)\.tsx?$/.test(file));
  const once = files.filter((file) => {
    const text = readFileSync(path.join(source, file), "utf8");
    const effects = text.split("useEffect(() => {").slice(1);
    // An effect ends where its list of dependencies begins.
    return effects.some((effect) => /\.look\([^;]*?\)\s*\.then\(/.test(effect.split(/\n {2}\}, \[/)[0] ?? ""));
  });
  expect(once.sort()).toEqual(Object.keys(EXCEPTIONS).sort());
});
