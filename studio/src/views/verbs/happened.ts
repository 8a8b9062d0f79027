// SPDX-License-Identifier: Apache-2.0
// History of one verb instance, from the log.
import { useMemo } from "react";
import type { LogEntry } from "../../control/shapes";
import { useControl, useTopic } from "../../shell/context";

const KINDS = new Set([
  "start",
  "admission",
  "transition",
  "condition",
  "ending",
  "end",
  "fault",
  "overrun",
  "late",
  "command",
  "exchange",
]);

/** A log entry about an instance, with its number of repetitions. */
export interface RepeatedEntry extends LogEntry {
  times: number;
}

export function useHappened(instance: string | null): RepeatedEntry[] {
  const control = useControl();
  const log = useTopic(control.topics.log);
  return useMemo(() => (instance === null ? [] : happenedTo(instance, log?.entries ?? [])), [instance, log]);
}

export function happenedTo(instance: string, entries: LogEntry[], most = 60): RepeatedEntry[] {
  const found: RepeatedEntry[] = [];
  for (const entry of entries.toReversed()) {
    if (entry.about !== instance || !KINDS.has(entry.kind)) continue;
    const later = found.at(-1);
    if (later && later.kind === entry.kind && later.text === entry.text) later.times += 1;
    else if (found.length === most) break;
    else found.push({ ...entry, times: 1 });
  }
  return found;
}

/** Returns the lists that the latest transition since the last start left and entered. */
export function lastTransition(happened: RepeatedEntry[]): { from: string; to: string } | null {
  for (const entry of happened) {
    if (entry.kind === "start" || entry.kind === "admission") return null;
    const lists = entry.kind === "transition" ? /'([^']+)' after '([^']+)'/.exec(entry.text) : null;
    if (lists?.[1] && lists[2]) return { from: lists[2], to: lists[1] };
  }
  return null;
}
