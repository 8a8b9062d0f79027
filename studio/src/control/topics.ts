// SPDX-License-Identifier: Apache-2.0
import type { Refusal } from "./refusals";
import type { End, InstalledInstances, LogEntry, Statistics } from "./shapes";
import type { Stream, Topic } from "./stream";
import { WatchedValue } from "./watched";

/** Interval between statistics updates, ms. */
const STATISTICS_MS = 500;
/** Maximum number of log entries, and of ends, that the page keeps. */
export const KEPT_MAX = 20_000;

/** A topic that several views share through one subscription, which exists as long as the topic has watchers. */
class SharedTopic<T> {
  readonly latest = new WatchedValue<T | null>(null);
  readonly trouble = new WatchedValue<Refusal[]>([]);
  readonly #stream: Stream;
  readonly #topic: () => Topic;
  readonly #take: (frame: Record<string, unknown>, before: T | null) => T;
  #users = 0;
  #end: (() => void) | null = null;

  constructor(stream: Stream, topic: (before: T | null) => Topic, take: (frame: Record<string, unknown>, before: T | null) => T) {
    this.#stream = stream;
    this.#topic = () => topic(this.latest.get());
    this.#take = take;
  }

  /** Watches the topic until the returned function is called. */
  readonly watch = (watcher: () => void): (() => void) => {
    const ends = [this.latest.watch(watcher), this.trouble.watch(watcher)];
    this.#users += 1;
    if (!this.#end) this.#begin();
    return () => {
      for (const end of ends) end();
      this.#users -= 1;
      if (this.#users > 0) return;
      this.#end?.();
      this.#end = null;
    };
  };

  readonly get = (): T | null => this.latest.get();

  #begin(): void {
    this.#end = this.#stream.subscribe(this.#topic(), {
      text: (frame) => {
        this.trouble.set([]);
        this.latest.set(this.#take(frame, this.latest.get()));
      },
      refused: (refusals) => {
        this.trouble.set(refusals);
        this.#end = null;
      },
      again: this.#topic,
    });
  }
}

/** Entries, and the number of entries that were dropped before they could be read. */
export interface KeptEntries<T> {
  entries: T[];
  dropped: number;
  /** Entries of earlier runs, before the system restarted. */
  earlier: T[];
  /** In a recording, the entries after the cursor. */
  later?: readonly T[];
}

export type { SharedTopic as Shared };

/** Topics that the whole page follows. */
export class Topics {
  readonly statistics: SharedTopic<Statistics>;
  readonly installed: SharedTopic<InstalledInstances>;
  readonly log: SharedTopic<KeptEntries<LogEntry>>;
  readonly ends: SharedTopic<KeptEntries<End>>;

  /** Restarts all topics, because the system has restarted. */
  renew(): void {
    this.statistics.latest.set(null);
    this.installed.latest.set(null);
    this.log.latest.set(aged(this.log.latest.get()));
    this.ends.latest.set(aged(this.ends.latest.get()));
  }

  constructor(stream: Stream) {
    this.statistics = new SharedTopic(
      stream,
      () => ({ subscribe: "statistics", every_ms: STATISTICS_MS }),
      (frame) => frame.statistics as Statistics,
    );
    this.installed = new SharedTopic(
      stream,
      () => ({ subscribe: "installed" }),
      (frame) => frame.installed as InstalledInstances,
    );
    this.log = new SharedTopic<KeptEntries<LogEntry>>(
      stream,
      (before) => ({ subscribe: "log", since: (before?.entries.at(-1)?.sequence ?? -1) + 1 }),
      (frame, before) => kept(before, frame.log as LogEntry[], frame.dropped as number),
    );
    this.ends = new SharedTopic<KeptEntries<End>>(
      stream,
      (before) => ({ subscribe: "ends", since: (before?.entries.at(-1)?.number ?? -1) + 1 }),
      (frame, before) => kept(before, frame.ends as End[], frame.dropped as number),
    );
  }
}

function kept<T>(before: KeptEntries<T> | null, more: T[], dropped: number): KeptEntries<T> {
  const entries = [...(before?.entries ?? []), ...more];
  return { entries: entries.slice(-KEPT_MAX), dropped: (before?.dropped ?? 0) + (dropped || 0), earlier: before?.earlier ?? [] };
}

/** Returns the entries after a restart of the system: current entries become earlier ones, and counting starts again. */
export function aged<T>(before: KeptEntries<T> | null): KeptEntries<T> | null {
  return before && { entries: [], dropped: 0, earlier: [...before.earlier, ...before.entries].slice(-KEPT_MAX) };
}
