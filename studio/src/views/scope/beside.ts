// SPDX-License-Identifier: Apache-2.0
// Two runs over each other: another recording behind the one that is shown, moved in time so that a moment of both is one.
import type { LogEntry } from "../../control/shapes";
import type { Past } from "../../control/source";

/** Name of the moment at which a recording begins. */
export const BEGINNING = "the beginning";

/** A recording behind another one. */
export interface Beside {
  readonly past: Past;
  /** Moment that happened in both, and its occurrence: here, there. */
  readonly moment: string;
  readonly here: number;
  readonly there: number;
}

/** Moments of a recording, by what happened: times of each, ns, in their order. Instances of one verb are not told apart. */
export function momentsOf(past: Pick<Past, "log" | "begins_ns">): ReadonlyMap<string, number[]> {
  const found = new Map([[BEGINNING, [past.begins_ns]]]);
  for (const entry of past.log) {
    const name = momentOf(entry);
    if (name === null) continue;
    const time_ns = Math.round(entry.time_s * 1e9);
    const known = found.get(name);
    if (known) known.push(time_ns);
    else found.set(name, [time_ns]);
  }
  return found;
}

/** "sway: rose" of a condition, "sway: start" of a start; null of all else. */
function momentOf({ kind, about, text }: LogEntry): string | null {
  const verb = about.replace(/#\d+$/, "");
  if (kind === "start") return `${verb}: start`;
  if (kind !== "condition") return null;
  return `${verb}: ${text.replace(/ \(reported by .*$/, "")}`;
}

/** Moments that both have, in the order of the first one. */
export function shared(one: ReadonlyMap<string, number[]>, other: ReadonlyMap<string, number[]>): string[] {
  return [...one.keys()].filter((name) => other.has(name));
}

/** Index of the time that is nearest to a time. */
export function nearest(times_ns: readonly number[], to_ns: number): number {
  return times_ns.reduce((best, time, at) => (Math.abs(time - to_ns) < Math.abs((times_ns[best] ?? time) - to_ns) ? at : best), 0);
}

/** Returns how much later the same moment is there than here, ns. */
export function shiftOf(here: Pick<Past, "log" | "begins_ns">, beside: Beside): number {
  const timeOf = (past: Pick<Past, "log" | "begins_ns">, at: number) => momentsOf(past).get(beside.moment)?.[at] ?? past.begins_ns;
  return timeOf(beside.past, beside.there) - timeOf(here, beside.here);
}
