// SPDX-License-Identifier: Apache-2.0
import { tr } from "../../language/text";
import { Attempts } from "../asking";
import type { Looks } from "../calls";
import type { Control } from "../control";
import { RefusalError, refusalsOf } from "../refusals";
import type {
  RecordingContents as About,
  Alarms,
  Configuration,
  End,
  Geometry,
  InstalledInstances,
  LogEntry,
  Names,
  RecordedSpan,
  Role,
  Statistics,
  VerbSummary,
  Version,
} from "../shapes";
import type { Past, Source, Topic } from "../source";
import { StartedInstances } from "../started";
import { notNow } from "../still";
import type { KeptEntries } from "../topics";
import { WatchedValue } from "../watched";
import { onSvvs } from "./joints";
import { ReplayRun } from "./replaying";
import { byInstance, countUntil, installedAt, type RecordedStructure, toNs } from "./state";
import { notRecorded, RecordedValues } from "./values";

class AtCursor<T> implements Topic<T> {
  readonly latest = new WatchedValue<T | null>(null);
  readonly trouble = new WatchedValue([]);
  readonly watch = this.latest.watch;
  readonly get = this.latest.get;
}

/** A recording as seen by the views: every value and state is the one at the cursor. */
export class Recording implements Source, Past {
  readonly name: string;
  readonly about: About;
  readonly cursor: WatchedValue<number>;
  /** Cursor position that the views show; follows `cursor` with a delay. */
  readonly shown: WatchedValue<number>;
  /** Reason why the values at the cursor could not be read; empty if they could be read. */
  readonly trouble = new WatchedValue<ReturnType<typeof refusalsOf>>([]);
  readonly restarts = new WatchedValue(0);
  readonly replayed: ReplayRun;
  readonly differs: ReplayRun["differs"];
  readonly started = new StartedInstances();
  readonly role: Role = "observe";
  readonly values: RecordedValues;
  readonly alarms = { latest: new WatchedValue<Alarms | null>(null), trouble: new WatchedValue([]), look: async () => undefined };
  readonly topics = {
    statistics: new AtCursor<Statistics>(),
    installed: new AtCursor<InstalledInstances>(),
    log: new AtCursor<KeptEntries<LogEntry>>(),
    ends: new AtCursor<KeptEntries<End>>(),
  };
  readonly log: readonly LogEntry[];
  readonly #ends: readonly End[];
  readonly #installed: readonly RecordedStructure<InstalledInstances>[];
  readonly #byInstance: ReadonlyMap<string, LogEntry[]>;
  readonly #channels: ReadonlyMap<string, About["channels"][number]>;
  readonly #live: Control;
  readonly #times = new Map<string, number>();
  #looking = false;
  #again = false;

  /** Opens a recording in the system's recordings folder. Throws `RefusalError`. */
  static async open(live: Control, name: string, signal?: AbortSignal): Promise<Recording> {
    const about = await live.look("recorded", { path: name }, signal);
    const all = async <T>(topic: string) => {
      const found: RecordedStructure<T>[] = [];
      for (let since: number | null = 0; since !== null; ) {
        const part: { messages: { time_ns: number; message: unknown }[]; next: number | null } = await live.look(
          "recorded_messages",
          { path: name, topic, since },
          signal,
        );
        found.push(...(part.messages as RecordedStructure<T>[]));
        since = part.next;
      }
      return found;
    };
    const [log, ends, installed] = await Promise.all([all<LogEntry>("/log"), all<End>("/ends"), all<InstalledInstances>("/installed")]);
    return new Recording(live, name, about, { log, ends, installed });
  }

  private constructor(
    live: Control,
    name: string,
    about: About,
    told: { log: RecordedStructure<LogEntry>[]; ends: RecordedStructure<End>[]; installed: RecordedStructure<InstalledInstances>[] },
  ) {
    this.#live = live;
    this.name = name;
    this.about = about;
    this.log = told.log.map((one) => one.message);
    this.#ends = told.ends.map((one) => one.message);
    this.#installed = told.installed;
    this.#byInstance = byInstance(this.log);
    this.replayed = new ReplayRun(live, name, () => this.#installed.map((one) => one.message));
    this.differs = this.replayed.differs;
    this.#channels = new Map(about.channels.map((channel) => [channel.name, channel]));
    this.cursor = new WatchedValue(about.begins_ns);
    this.shown = new WatchedValue(Number.NaN);
    this.values = new RecordedValues(
      (value) => this.#channels.has(value),
      () => queueMicrotask(() => this.#lookSoon()),
    );
    this.cursor.watch(() => {
      // Another position is another question.
      this.#attempts = new Attempts();
      this.#lookSoon();
    });
    this.#lookSoon();
  }

  get version(): Version {
    return {
      ...this.#live.version,
      system: this.about.system,
      run: tr("control.recordingName", { name: this.name }),
      clock: this.about.clock,
    } as Version;
  }

  get stream() {
    return { subscribe: () => () => undefined, connection: this.#live.stream.connection };
  }

  pressed(): null {
    return null;
  }

  get past(): Past {
    return this;
  }

  get origin(): Source {
    return this;
  }

  get begins_ns(): number {
    return this.about.begins_ns;
  }

  get ends_ns(): number {
    return this.about.ends_ns;
  }

  may(role: Role): boolean {
    return role === "observe";
  }

  channel(name: string): About["channels"][number] | undefined {
    return this.#channels.get(name);
  }

  async others(): Promise<string[]> {
    return (await this.#live.look("recordings", {})).map((file) => file.name);
  }

  beside(name: string): Promise<Past> {
    return Recording.open(this.#live, name);
  }

  /** Ends all attempts to read the values at the cursor, because the views no longer show the recording. */
  leave(): void {
    this.#isLeft = true;
    clearTimeout(this.#retry);
  }

  /** Moves the cursor; all views follow. */
  go(time_ns: number): void {
    this.cursor.set(Math.min(this.ends_ns, Math.max(this.begins_ns, Math.round(time_ns))));
  }

  /** Moves to the next or previous firing that stored a value. Throws `RefusalError`. */
  async step(back: boolean): Promise<void> {
    const found = await this.#live.look("recorded_firing", { path: this.name, time_ns: this.cursor.get(), back });
    if (found !== null) this.go(found);
  }

  /** Moves to the next or previous log entry for which `fits` returns true; returns false if there is none. */
  toEntry(back: boolean, fits: (entry: LogEntry) => boolean = () => true): boolean {
    const now_ns = this.cursor.get();
    const at = (entry: LogEntry) => toNs(entry.time_s);
    const found = back
      ? this.log.findLast((entry) => at(entry) < now_ns && fits(entry))
      : this.log.find((entry) => at(entry) > now_ns && fits(entry));
    if (found) this.go(at(found));
    return found !== undefined;
  }

  async *span(names: string[], from_ns: number, to_ns: number, columns: number, signal: AbortSignal): AsyncIterable<RecordedSpan> {
    for (let since: number | null = 0; since !== null; ) {
      const asked = { path: this.name, names, from_ns: Math.round(from_ns), to_ns: Math.round(to_ns), columns, since };
      const part: RecordedSpan = await this.#live.look("recorded_span", asked, signal);
      yield part;
      since = part.next;
    }
  }

  async look<N extends keyof Looks>(name: N, args: Looks[N][0]): Promise<Looks[N][1]> {
    return (await this.#answer(name, args as Record<string, unknown>)) as Looks[N][1];
  }

  order(): Promise<never> {
    return Promise.reject(notNow(tr("control.nameIsARecordingAndCannot", { name: this.name })));
  }

  aside(): Promise<never> {
    return Promise.reject(notNow(tr("control.nameIsARecordingAndCannot", { name: this.name })));
  }

  stop(): Promise<never> {
    return Promise.reject(notNow(tr("control.nameIsARecordingAndCannot", { name: this.name })));
  }

  async #answer(call: string, args: Record<string, unknown>): Promise<unknown> {
    switch (call) {
      case "configuration":
        return JSON.parse(this.about.metadata.configuration ?? "{}") as Configuration;
      case "names": {
        const names = JSON.parse(this.about.metadata.names ?? "{}") as Names;
        return { ...names, svvs: this.about.channels.filter((channel) => channel.kind === "svv").map((channel) => channel.name) };
      }
      case "verbs":
        return verbsOf(this.#installed);
      case "geometry":
        return await this.#geometry(String(args.device));
      case "read": {
        const { values } = await this.#at(args.names as string[], []);
        return { time_ns: this.cursor.get(), values };
      }
      default:
        throw new RefusalError(notRecorded(call), 0);
    }
  }

  async #geometry(device: string): Promise<Geometry> {
    const topic = `/geometry/${device}`;
    const { messages } = await this.#live.look("recorded_at", { path: this.name, time_ns: this.ends_ns, topics: [topic] });
    const found = messages[topic]?.message as Geometry | undefined;
    if (!found) throw new RefusalError([{ class: "InvalidState", message: tr("control.theRecordingHasNoShapeOf", { device }) }], 0);
    return onSvvs(
      found,
      this.#installed.flatMap((one) => one.message.instances),
      (name) => this.#channels.has(name),
    );
  }

  #at(names: string[], topics: string[]) {
    const known = Object.fromEntries(topics.filter((topic) => this.#times.has(topic)).map((topic) => [topic, this.#times.get(topic)]));
    return this.#live.look("recorded_at", { path: this.name, time_ns: this.cursor.get(), names, topics, known: known as never });
  }

  #attempts = new Attempts();
  #retry: ReturnType<typeof setTimeout> | undefined;
  #isLeft = false;

  // Only one request is under way at a time. If the cursor moves meanwhile, its newest position is requested afterwards.
  #lookSoon(): void {
    clearTimeout(this.#retry);
    if (this.#isLeft) return;
    if (this.#looking) {
      this.#again = true;
      return;
    }
    this.#looking = true;
    this.#again = false;
    const time_ns = this.cursor.get();
    this.#at(this.values.names(), ["/statistics", "/alarms"])
      .then(
        (found) => {
          this.#attempts = new Attempts();
          this.#show(time_ns, found);
        },
        (why) => {
          this.trouble.set(refusalsOf(why));
          const wait_ms = this.#attempts.againAfter_ms(why);
          if (wait_ms !== null && !this.#isLeft) this.#retry = setTimeout(() => this.#lookSoon(), wait_ms);
        },
      )
      .finally(() => {
        this.#looking = false;
        if (this.#again) this.#lookSoon();
      });
  }

  #show(time_ns: number, found: Looks["recorded_at"][1]): void {
    this.trouble.set([]);
    for (const [topic, said] of Object.entries(found.messages)) {
      if (said) this.#times.set(topic, said.time_ns);
      else this.#times.delete(topic);
      if (topic === "/alarms") this.alarms.latest.set((said?.message as Alarms | undefined) ?? null);
      else this.#told = (said?.message as Statistics | undefined) ?? null;
    }
    const now = this.#told;
    this.topics.installed.latest.set(installedAt(this.#installed, this.#byInstance, now, time_ns));
    this.topics.statistics.latest.set(now && { ...now, now_s: time_ns / 1e9 });
    this.topics.log.latest.set(this.#kept(this.log, (entry) => entry.time_s, time_ns));
    this.topics.ends.latest.set(this.#kept(this.#ends, (end) => end.report.time_s, time_ns));
    this.values.take(found.values);
    this.shown.set(time_ns);
  }

  #told: Statistics | null = null;

  #kept<T>(all: readonly T[], timeOf: (entry: T) => number, time_ns: number): KeptEntries<T> {
    const entries = all.slice(0, countUntil(all, timeOf, time_ns));
    return { entries, dropped: 0, earlier: [], later: all.slice(entries.length) };
  }
}

function verbsOf(installed: readonly RecordedStructure<InstalledInstances>[]): VerbSummary[] {
  const verbs = new Map<string, VerbSummary>();
  for (const { message } of installed) {
    for (const { verb, owner, lists } of message.instances) {
      if (verbs.has(verb)) continue;
      const names = lists.map((list) => list.name);
      const supports = owner === null ? [] : [owner];
      verbs.set(verb, {
        name: verb,
        doc: "",
        class: owner === null ? "acts on devices" : "supports devices",
        supports,
        simple: names.length === 1,
        lists: names,
        parts: {},
      });
    }
  }
  return [...verbs.values()];
}
