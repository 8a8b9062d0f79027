// SPDX-License-Identifier: Apache-2.0
// Control of the virtual clock from the page: at a rate, or firing by firing until a verb reports a condition.
import type { Control } from "../control/control";
import type { LogEntry } from "../control/shapes";

type Clock = Pick<Control, "order" | "look">;

/**
 * First the real-time interval between two advances of a clock that runs at a rate, and then the maximum real time that one advance
 * makes up for, ms.
 */
const MOVE_MS = 40;
const MOVE_MAX_MS = 200;

/** Runs the clock at a rate until `signal` aborts it. Throws `RefusalError`. */
export async function runAt(clock: Clock, rate: () => number, signal: AbortSignal): Promise<void> {
  let before = performance.now();
  while (!signal.aborted) {
    await new Promise((passed) => setTimeout(passed, MOVE_MS));
    const now = performance.now();
    const duration_ns = Math.round(Math.min(MOVE_MAX_MS, now - before) * 1e6 * rate());
    before = now;
    if (!signal.aborted && duration_ns > 0) await clock.order("advance", { duration_ns });
  }
}

/**
 * Returns whether a log entry is a condition with all of these words in its instance or text; if no words are given, any condition
 * matches.
 */
export function isCondition(entry: LogEntry, words: string): boolean {
  if (entry.kind !== "condition") return false;
  const said = `${entry.about} ${entry.text}`.toLowerCase();
  return words
    .toLowerCase()
    .split(/\s+/)
    .every((word) => said.includes(word));
}

/**
 * Runs firing by firing until a firing reports a matching condition, and stops after that firing. Returns the log entry, or null if
 * there are no further firings or `signal` aborts the run. Throws `RefusalError`.
 */
export async function runUntil(clock: Clock, words: string, signal: AbortSignal): Promise<LogEntry | null> {
  let since = await behind(clock);
  while (!signal.aborted) {
    if (!(await clock.order("step", {}))) return null;
    const entries = await clock.look("log", { since });
    const found = entries.find((entry) => isCondition(entry, words));
    if (found) return found;
    since = (entries.at(-1)?.sequence ?? since - 1) + 1;
  }
  return null;
}

/** Returns the number that the next log entry will have. */
async function behind(clock: Clock): Promise<number> {
  return ((await clock.look("log", {})).at(-1)?.sequence ?? -1) + 1;
}
