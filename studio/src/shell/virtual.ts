// SPDX-License-Identifier: Apache-2.0
// The virtual clock, moved from the page: at a rate, or firing by firing until a verb reports a condition.
import type { Control } from "../control/control";
import type { LogEntry } from "../control/shapes";

type Clock = Pick<Control, "order" | "look">;

/** Real time between two moves of a clock that runs at a rate, ms; no move is longer than what passed meanwhile, or than this. */
const MOVE_MS = 40;
const MOVE_MAX_MS = 200;

/** Lets the clock run at a rate until `signal` holds it. Errors: `RefusalError`. */
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

/** Returns whether an entry of the log is a condition with all of these words in its instance or name; no words: any condition. */
export function isCondition(entry: LogEntry, words: string): boolean {
  if (entry.kind !== "condition") return false;
  const said = `${entry.about} ${entry.text}`.toLowerCase();
  return words
    .toLowerCase()
    .split(/\s+/)
    .every((word) => said.includes(word));
}

/**
 * Runs firing by firing until one of them reports a condition that fits, and stands behind that firing. Returns the entry of the log; null
 * where nothing is ever going to happen, and where `signal` held it. Errors: `RefusalError`.
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

/** The number of the entry that comes next. */
async function behind(clock: Clock): Promise<number> {
  return ((await clock.look("log", {})).at(-1)?.sequence ?? -1) + 1;
}
