// SPDX-License-Identifier: Apache-2.0
// State of what was installed, at a time of a recording: from what was told now and then, and from the log, which has every start,
// transition and end with its own time.
import type { InstalledInstance, InstalledInstances, LogEntry, Statistics } from "../shapes";

/** Structure that was installed, as it was told at a time. */
export interface RecordedStructure<T> {
  time_ns: number;
  message: T;
}

/** Indices of the log's entries about each instance. */
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
 * The instances at a time. An instance is told of a moment after it was made: what the log has of it before counts too, and its form is
 * then the one that was told first.
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

/** A time of the log as a number of the cursor. */
export function toNs(time_s: number): number {
  return Math.round(time_s * 1e9);
}

/** Returns the number of entries, which are in order of time, that are not later than a time. `timeOf`: in s. */
export function countUntil<T>(entries: readonly T[], timeOf: (entry: T) => number, time_ns: number): number {
  let [low, high] = [0, entries.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (toNs(timeOf(entries[middle] as T)) <= time_ns) low = middle + 1;
    else high = middle;
  }
  return low;
}
