// SPDX-License-Identifier: Apache-2.0
import type { Asides, Looks, Orders, Stops } from "./calls";
import type { Refusal } from "./refusals";
import type { Alarms, End, InstalledInstances, LogEntry, Reading, RecordedSpan, Role, Statistics, Version } from "./shapes";
import type { StartedInstances } from "./started";
import type { Stream } from "./stream";
import type { KeptEntries } from "./topics";
import type { WatchedValue } from "./watched";

/** Something that comes by itself. */
export interface Topic<T> {
  readonly latest: WatchedValue<T | null>;
  readonly trouble: WatchedValue<Refusal[]>;
  /** Looks at it, until the answer is called. */
  readonly watch: (watcher: () => void) => () => void;
  readonly get: () => T | null;
}

/** Watcher of a value: told at most once in an animation frame. `missing`: why there is none. */
export type Watcher = (reading: Reading | null, missing: Refusal[] | null) => void;

export interface Values {
  /** Watches a value; the answer ends it. `every_ms`: how often it is wanted at the most. */
  watch(name: string, watcher: Watcher, every_ms?: number): () => void;
  /** The last value that came, where anybody watches it. */
  latest(name: string): Reading | undefined;
  /** Asks again for what was not known. */
  renew(): void;
}

/** The first value that is not as it was recorded. */
export interface Differs {
  time_ns: number;
  /** Block and port, firing, and kind of the write. */
  where: string;
  /** The SVV or private cell that it is stored in; null: it is not known. */
  signal: string | null;
  recorded: string;
  replayed: string;
}

/** Times that can be asked for: those of a recording. */
export interface Past {
  readonly name: string;
  /** All of its log, whatever the cursor. */
  readonly log: readonly LogEntry[];
  readonly begins_ns: number;
  readonly ends_ns: number;
  /** Where the views stand, ns on the system's clock. */
  readonly cursor: WatchedValue<number>;
  /** The first value that its replay found to be other than it was recorded; null: none is known. */
  readonly differs: WatchedValue<Differs | null>;
  go(time_ns: number): void;
  /** SVVs and cells over a span, part by part: each part follows the one before. */
  span(names: string[], from_ns: number, to_ns: number, columns: number, signal: AbortSignal): AsyncIterable<RecordedSpan>;
  /** Returns a channel: type, unit, number of elements; undefined if it was not recorded. */
  channel(name: string): { name: string; type_text: string; unit: string; components: number } | undefined;
  /** The names of all recordings beside which it can be laid, the newest first; its own too. Errors: `RefusalError`. */
  others(): Promise<string[]>;
  /** Another recording, with a cursor of its own that nobody sees. Errors: `RefusalError`. */
  beside(name: string): Promise<Past>;
}

/** When a command was given, by the daemon's clock, ms; null: there was no connection. */
export type PressTime = number | null;

/**
 * Source of the views: the running system, the same standing still, or a recording. A view reads this and asks for nothing else, so that
 * it knows neither which it is nor what time it is.
 */
export interface Source {
  readonly version: Version;
  readonly role: Role;
  readonly restarts: WatchedValue<number>;
  readonly stream: Pick<Stream, "subscribe" | "connection">;
  readonly topics: {
    readonly statistics: Topic<Statistics>;
    readonly installed: Topic<InstalledInstances>;
    readonly log: Topic<KeptEntries<LogEntry>>;
    readonly ends: Topic<KeptEntries<End>>;
  };
  readonly values: Values;
  readonly alarms: { readonly latest: WatchedValue<Alarms | null>; readonly trouble: WatchedValue<Refusal[]>; look(): Promise<void> };
  readonly started: StartedInstances;
  /** Past that can be asked for; null: there is only the present. */
  readonly past: Past | null;
  /** Source that it is a standing picture of; itself if it moves. */
  readonly origin: Source;
  may(role: Role): boolean;
  /** Makes a call that only looks. Errors: `RefusalError`. */
  look<N extends keyof Looks>(name: N, args: Looks[N][0], signal?: AbortSignal): Promise<Looks[N][1]>;
  /** Makes a call that commands. Errors: `RefusalError`: what is past cannot be commanded. */
  order<N extends keyof Orders>(name: N, args: Orders[N][0], signal?: AbortSignal, pressed?: PressTime): Promise<Orders[N][1]>;
  /** Makes a call that leaves the machine alone: it needs its role and no command. Errors: `RefusalError`. */
  aside<N extends keyof Asides>(name: N, args: Asides[N][0]): Promise<Asides[N][1]>;
  /** Returns when the person gave the command that is being made. For one of several calls: read before the first, and given to each. */
  pressed(): PressTime;
  stop<N extends keyof Stops>(name: N, args: Stops[N][0]): Promise<void>;
}
