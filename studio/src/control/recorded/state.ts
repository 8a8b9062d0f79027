// SPDX-License-Identifier: Apache-2.0
// State of the installed objects at a time of a recording: from the periodic snapshots, and from the log, which contains every start,
// transition and end with its time.
import type { InstalledInstance, InstalledInstances, LogEntry, Statistics } from "../shapes";

/** A report of the installed structure, with the time of the report. */
export interface RecordedStructure<T> {
  time_ns: number;
  message: T;
}

/** Returns the log entries about each instance. */
export function byInstance(log: readonly LogEntry[]): ReadonlyMap<string, LogEntry[]> {
  const found = new Map<string, LogEntry[]>();
  for (const entry of log) {
    if (entry.kind !== "start" && entry.kind !== "transition" && entry.kind !== "end") continue;
    const known = found.get(entry.about);
    if (known) known.push(entry);
    else found.set(entry.about, [entry]);
  }
  return found;
}

/**
 * Returns the instances at a time. An instance is reported a moment after its creation: if the log has earlier entries about it, it is
 * included as described in its first report.
 */
export function installedAt(
  told: readonly RecordedStructure<InstalledInstances>[],
  log: ReadonlyMap<string, LogEntry[]>,
  now: Statistics | null,
  time_ns: number,
): InstalledInstances {
  const last = told.findLast((one) => one.time_ns <= time_ns);
  const present = new Map((last?.message.instances ?? []).map((instance) => [instance.id, instance]));
  for (const { time_ns: at_ns, message } of told) {
    if (at_ns <= time_ns) continue;
    for (const instance of message.instances) {
      const first = log.get(instance.name)?.[0];
      if (!present.has(instance.id) && first && toNs(first.time_s) <= time_ns) present.set(instance.id, instance);
    }
  }
  const instances = [...present.values()].sort((one, other) => one.id - other.id);
  return { instances: instances.map((instance) => stoodAt(instance, log.get(instance.name) ?? [], now, time_ns)) };
}

function stoodAt(instance: InstalledInstance, entries: readonly LogEntry[], now: Statistics | null, time_ns: number): InstalledInstance {
  let { state, list, starts } = instance;
  const counted = now?.instances.find((one) => one.id === instance.id);
  if (counted) state = counted.state;
  else if (entries.length > 0) state = "created";
  if (entries.length > 0) starts = 0;
  for (const entry of entries) {
    if (toNs(entry.time_s) > time_ns) break;
    const isNews = !counted || entry.time_s > (now?.now_s ?? 0);
    if (entry.kind === "start") {
      list = instance.initial;
      starts += 1;
      if (isNews) state = "running";
    } else if (entry.kind === "end") {
      if (isNews) state = "ended";
    } else {
      list = /'([^']+)' after '[^']+'/.exec(entry.text)?.[1] ?? list;
    }
  }
  return { ...instance, state, list, starts };
}

/** Converts a time of the log to a cursor position. */
export function toNs(time_s: number): number {
  return Math.round(time_s * 1e9);
}

/** Returns the number of entries, sorted by time, that are not later than `time_ns`. `timeOf` returns the time of an entry in seconds. */
export function countUntil<T>(entries: readonly T[], timeOf: (entry: T) => number, time_ns: number): number {
  let [low, high] = [0, entries.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (toNs(timeOf(entries[middle] as T)) <= time_ns) low = middle + 1;
    else high = middle;
  }
  return low;
}
