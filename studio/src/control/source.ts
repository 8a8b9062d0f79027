// SPDX-License-Identifier: Apache-2.0
import type { Asides, Looks, Orders, Stops } from "./calls";
import type { Refusal } from "./refusals";
import type { Alarms, End, InstalledInstances, LogEntry, Reading, RecordedSpan, Role, Statistics, Version } from "./shapes";
import type { StartedInstances } from "./started";
import type { Stream } from "./stream";
import type { KeptEntries } from "./topics";
import type { WatchedValue } from "./watched";

/** A topic to which the page subscribes. */
export interface Topic<T> {
  readonly latest: WatchedValue<T | null>;
  readonly trouble: WatchedValue<Refusal[]>;
  /** Registers a watcher of the topic; it stays registered until the returned function is called. */
  readonly watch: (watcher: () => void) => () => void;
  readonly get: () => T | null;
}

/** Watcher of a value, called at most once per animation frame. If there is no value, `missing` gives the reason. */
export type Watcher = (reading: Reading | null, missing: Refusal[] | null) => void;

export interface Values {
  /** Watches a value until the returned function is called. `every_ms` is the minimum interval between updates. */
  watch(name: string, watcher: Watcher, every_ms?: number): () => void;
  /** Returns the latest value received, if the value is being watched. */
  latest(name: string): Reading | undefined;
  /** Requests names again that did not exist before. */
  renew(): void;
}

/** The first value that differs from the recording. */
export interface Differs {
  time_ns: number;
  /** Block and port, firing, and kind of write. */
  where: string;
  /** SVV or private cell that stores the value; null if unknown. */
  signal: string | null;
  recorded: string;
  replayed: string;
}

/** The past of a recording, which can be read at any time within its span. */
export interface Past {
  readonly name: string;
  /** The whole log, regardless of the cursor. */
  readonly log: readonly LogEntry[];
  readonly begins_ns: number;
  readonly ends_ns: number;
  /** Time that the views show, ns on the system's clock. */
  readonly cursor: WatchedValue<number>;
  /** The first value for which a replay differed from the recording; null if none is known. */
  readonly differs: WatchedValue<Differs | null>;
  go(time_ns: number): void;
  /** Yields the values of SVVs and cells over a span, in consecutive sections. */
  span(names: string[], from_ns: number, to_ns: number, columns: number, signal: AbortSignal): AsyncIterable<RecordedSpan>;
  /** Returns the type, unit and number of elements of a channel; undefined if it was not recorded. */
  channel(name: string): { name: string; type_text: string; unit: string; components: number } | undefined;
  /** Returns the names of all recordings with which this one can be compared, newest first, including itself. Throws `RefusalError`. */
  others(): Promise<string[]>;
  /** Opens another recording for comparison, with its own hidden cursor. Throws `RefusalError`. */
  beside(name: string): Promise<Past>;
}

/** Time at which a command was given, ms on the daemon's clock; null without a connection. */
export type PressTime = number | null;

/**
 * Source of the views: the running system, the paused system, or a recording. Views use only this interface, so they depend neither on
 * the kind of source nor on the time that it shows.
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
  /** The past that can be read; null if only the current state can be read. */
  readonly past: Past | null;
  /** The source that was paused to create this one; the source itself if it is not paused. */
  readonly origin: Source;
  may(role: Role): boolean;
  /** Makes a read-only call. Throws `RefusalError`. */
  look<N extends keyof Looks>(name: N, args: Looks[N][0], signal?: AbortSignal): Promise<Looks[N][1]>;
  /** Makes a call that commands. Throws `RefusalError`; always does so if the source shows the past. */
  order<N extends keyof Orders>(name: N, args: Orders[N][0], signal?: AbortSignal, pressed?: PressTime): Promise<Orders[N][1]>;
  /** Makes a call that does not affect the machine: it requires the call's role, but not command. Throws `RefusalError`. */
  aside<N extends keyof Asides>(name: N, args: Asides[N][0]): Promise<Asides[N][1]>;
  /**
   * Returns the time at which the person gave the current command. If one command makes several calls, read it before the first, and
   * pass it to each.
   */
  pressed(): PressTime;
  stop<N extends keyof Stops>(name: N, args: Stops[N][0]): Promise<void>;
}
