// SPDX-License-Identifier: Apache-2.0
// Two runs on top of each other: another recording behind the displayed one, shifted in time so that one moment of both coincides.

import type { LogEntry } from "../../control/shapes";
import type { Past } from "../../control/source";
import { tr } from "../../language/text";

/** Name of the moment at which a recording begins. */
export const BEGINNING = tr("scope.theBeginning");

/** A recording shown behind another one for comparison. */
export interface Beside {
  readonly past: Past;
  /** Moment that occurs in both recordings; `here` and `there` are the indices of its occurrences in them. */
  readonly moment: string;
  readonly here: number;
  readonly there: number;
}

/** Returns the moments of a recording by name: the times of each, ns, in ascending order. Instances of one verb are not distinguished. */
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

/** Returns "sway: rose" for a condition, "sway: start" for a start, and null for other entries. */
function momentOf({ kind, about, text }: LogEntry): string | null {
  const verb = about.replace(/#\d+$/, "");
  if (kind === "start") return tr("scope.verbStart", { verb });
  if (kind !== "condition") return null;
  return `${verb}: ${text.replace(/ \(reported by .*$/, "")}`;
}

/** Returns the moments that occur in both recordings, in the order of the first. */
export function shared(one: ReadonlyMap<string, number[]>, other: ReadonlyMap<string, number[]>): string[] {
  return [...one.keys()].filter((name) => other.has(name));
}

/** Returns the index of the time nearest to `to_ns`. */
export function nearest(times_ns: readonly number[], to_ns: number): number {
  return times_ns.reduce((best, time, at) => (Math.abs(time - to_ns) < Math.abs((times_ns[best] ?? time) - to_ns) ? at : best), 0);
}

/** Returns the time by which the moment is later in the other recording, ns. */
export function shiftOf(here: Pick<Past, "log" | "begins_ns">, beside: Beside): number {
  const timeOf = (past: Pick<Past, "log" | "begins_ns">, at: number) => momentsOf(past).get(beside.moment)?.[at] ?? past.begins_ns;
  return timeOf(beside.past, beside.there) - timeOf(here, beside.here);
}
