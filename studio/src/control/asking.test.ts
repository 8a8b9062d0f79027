// SPDX-License-Identifier: Apache-2.0
import { readdirSync, readFileSync } from "node:fs";
import path from "node:path";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { AGAIN_MS, askUntilAnswered, faults } from "./asking";
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
  ["a refusal of a proxy", refused(502)],
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

test("after a fault of the system, a question is asked again at growing intervals", async () => {
  const begins_ms = Date.now();
  const asked_s: number[] = [];
  const ask = vi.fn<() => Promise<string>>().mockImplementation(() => {
    asked_s.push((Date.now() - begins_ms) / 1000);
    return Promise.reject(refused(500));
  });
  const withdraw = askUntilAnswered(system, { ask, take: vi.fn(), failed: vi.fn() });
  await vi.advanceTimersByTimeAsync(200_000);
  expect(asked_s).toEqual([0, 1, 3, 7, 15, 31, 63, 123, 183]);
  withdraw();
});

test("a fault is reported on the page if the question does not show its failures, until it is answered or withdrawn", async () => {
  const ask = vi.fn<() => Promise<string>>().mockRejectedValueOnce(refused(500)).mockResolvedValue("two");
  askUntilAnswered(system, { ask: () => Promise.reject(refused(429)), take: vi.fn() })();
  askUntilAnswered(system, { ask: () => Promise.reject(refused(500)), take: vi.fn(), failed: vi.fn() });
  askUntilAnswered(system, { ask, take: vi.fn() });
  const withdraw = askUntilAnswered(system, { ask: () => Promise.reject(refused(500)), take: vi.fn() });
  await vi.advanceTimersByTimeAsync(0);
  expect(faults.get().map((one) => one.message)).toEqual(["status 500", "status 500"]);
  await vi.advanceTimersByTimeAsync(AGAIN_MS);
  expect(faults.get()).toHaveLength(1);
  withdraw();
  expect(faults.get()).toEqual([]);
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

/** Reason of a question in a function that `askUntilAnswered` calls. */
const PASSED = "passed to `askUntilAnswered`";

/** Questions outside `askUntilAnswered`, by file and call, and the reason. */
const EXCEPTIONS: Record<string, string> = {
  "control/control.ts alarms": "read again every second",
  "control/recorded/recording.ts recorded": "a recording is opened at a press",
  "control/recorded/recording.ts recorded_at": "`Attempts` repeats the question of the cursor; a geometry is asked for by a view",
  "control/recorded/recording.ts recorded_firing": "a step is made at a press",
  "control/recorded/recording.ts recorded_messages": "a recording is opened at a press",
  "control/recorded/recording.ts recorded_span": "`Attempts` repeats it in the scope, its spectra and the path",
  "control/recorded/recording.ts recordings": "`others`, for which this test looks too",
  "control/recorded/replaying.ts replaying": "a replay is followed in a loop",
  "shell/virtual.ts log": "the clock is advanced at a press",
  "views/devices/Parameters.tsx device_parameter": PASSED,
  "views/devices/PointsPanel.tsx read": "a point is taught at a press",
  "views/devices/arms.ts arms": "read again every second",
  "views/devices/jogging.ts report": "a jog is followed in a loop",
  "views/devices/jogging.ts state": "a jog is followed in a loop",
  "views/devices/jogging.ts verb_form": "a jog begins at a press",
  "views/devices/jogging.ts wait": "a jog ends at a release",
  "views/devices/stage.ts corner": "a viewpoint, not a question",
  "views/devices/usePoints.ts points": "read again every two seconds",
  "views/devices/useVerb.ts report": "a motion begins at a press",
  "views/flow/edit/CompositionEditor.tsx compose": PASSED,
  "views/flow/edit/SystemVerb.tsx names": "a list is opened at a press",
  "views/flow/edit/SystemVerb.tsx verb_form": "a verb is chosen at a press",
  "views/flow/edit/WireField.tsx compatible": "a list is opened at a press",
  "views/flow/edit/system.ts compatible": "a wire is begun at a press",
  "views/flow/edit/trial.ts names": "a graph is tried at a press",
  "views/flow/edit/trial.ts state": "a trial is ended at a press",
  "views/recordings/Files.tsx recordings": "read again every two seconds",
  "views/recordings/index.tsx recording": "read again every second",
  "views/start/TourOffer.tsx geometry": PASSED,
  "views/verbs/InputField.tsx read": "a form is filled in at a press",
  "views/verbs/bounds.ts device_parameter": PASSED,
  "views/verbs/index.tsx verbs": "read again every two seconds",
  "views/workspaces/Import.tsx check_workspace": "a file is opened at a press",
  "views/workspaces/kept.ts workspaces": "read again every two seconds",
};

test("every question of the page is asked until it is answered, at a press, or again and again", () => {
  const source = path.resolve(import.meta.dirname, "..");
  const files = readdirSync(source, { recursive: true, encoding: "utf8" }).filter((file) => /(?<!\.test)\.tsx?$/.test(file));
  const read = (file: string) => readFileSync(path.join(source, file), "utf8");
  const others = files.flatMap((file) => questionsOutside(read(file)).map((call) => `${file} ${call}`));
  expect([...new Set(others)].sort()).toEqual(Object.keys(EXCEPTIONS).sort());
  const passed = Object.keys(EXCEPTIONS).filter((one) => EXCEPTIONS[one] === PASSED);
  for (const one of passed) expect(read(one.split(" ")[0] ?? ""), one).toContain("askUntilAnswered(");
});

test("a question is found in the forms that the page uses", () => {
  const found = (text: string) => questionsOutside(text);
  expect(found('useEffect(() => { control.look("names", {}).then(take); }, []);')).toEqual(["names"]);
  expect(found('useEffect(() => { void run(async () => set(await control.look("names", {}))); }, [run]);')).toEqual(["names"]);
  expect(found('const find = async () => { await control\n.look("geometry", { device }).catch(() => null); };')).toEqual(["geometry"]);
  expect(found('const read = useCallback(() => run(() => source.look(\n"state", { instance })), []);')).toEqual(["state"]);
  expect(found('return askUntilAnswered(control, { ask: (signal) => control.look("names", { at: (1) }, signal), take });')).toEqual([]);
  expect(found("void run(async () => setNames(await past.others()));")).toEqual(["others"]);
  expect(found('askUntilAnswered(control, { ask, take }); control.look("names", {});')).toEqual(["names"]);
});

/** Returns the names of the calls in `text` that no `askUntilAnswered(…)` contains. */
function questionsOutside(text: string): string[] {
  const covered = [...text.matchAll(/askUntilAnswered\(/g)].map(({ index }) => [index, endOf(text, index)] as const);
  return [...text.matchAll(/\.look\(\s*"(?<call>\w+)"|past\.(?<of_past>others)\(/g)]
    .filter(({ index }) => !covered.some(([begins, ends]) => index > begins && index < ends))
    .map(({ groups }) => groups?.call ?? groups?.of_past ?? "");
}

/** Returns the position of the bracket that closes the first one after `begins`. */
function endOf(text: string, begins: number): number {
  let depth = 0;
  for (let at = text.indexOf("(", begins); at < text.length; at += 1) {
    if (text[at] === "(") depth += 1;
    if (text[at] === ")") depth -= 1;
    if (depth === 0) return at;
  }
  throw new Error("a bracket is not closed");
}
