// SPDX-License-Identifier: Apache-2.0

import { Attempts } from "../../control/asking";
import type { LogEntry } from "../../control/shapes";
import type { Past, Source } from "../../control/source";
import { WatchedValue } from "../../control/watched";
import { presentTexts, tr } from "../../language/text";
import { type Beside, shiftOf } from "./beside";
import { type Feeding, Feeds } from "./feeds";
import { keepLast, kept } from "./keeping";
import type { ChannelCounts, DrawnTrace, Format, FromWorker, Row, Show, ToWorker, Window } from "./messages";
import { buffersOf, RecordedFeed } from "./recorded";
import { channelsOf, type Setup, type TraceSetup } from "./setup";
import { componentNames } from "./signal/components";
import type { Run, StreamChannel } from "./signal/frame";
import type { Range } from "./signal/ranges";
import type { Span, SweepState } from "./signal/sweep";
import { wholeOf } from "./whole";

/** State of the scope, updated a few times per second. */
export interface Status {
  state: SweepState;
  triggers: number;
  has_reference: boolean;
  triggered: boolean;
}

/**
 * The scope: its setup, the worker that stores and draws, and its channels. It keeps running while another view is open, so that a
 * motion started there is visible here.
 */
export class Scope {
  readonly setup: WatchedValue<Setup>;
  readonly channels = new WatchedValue<ReadonlyMap<string, StreamChannel>>(new Map());
  readonly status = new WatchedValue<Status>({ state: "rolling", triggers: 0, has_reference: false, triggered: false });
  readonly rows = new WatchedValue<Row[]>([]);
  readonly counts = new WatchedValue<ChannelCounts[]>([]);
  /** Time window on the screen if it does not follow the system. */
  readonly window = new WatchedValue<Window>(null);
  readonly stopped = new WatchedValue(false);
  readonly cursors = new WatchedValue<[number, number] | null>(null);
  readonly trouble = new WatchedValue<string>("");
  readonly feeds: Feeding;
  /** Readable past; null if the scope has only received values. */
  readonly past: Past | null;
  /** Recording shown behind this one. */
  readonly beside = new WatchedValue<Beside | null>(null);
  /** Span of the latest picture. */
  span: Span | null = null;
  /** Range of the x axis in the latest picture if it is not a time axis: Hz for spectra. */
  along: Range | null = null;
  readonly #control: Source;
  readonly #worker: Worker;
  readonly #recorded: RecordedFeed | null;
  #behind: { feed: RecordedFeed; shift_ns: number } | null = null;
  readonly #exports = new Map<number, { done: (blob: Blob) => void; failed: (why: Error) => void }>();
  #shown: ((drawn: DrawnTrace) => void) | null = null;
  #log_end: (() => void) | null = null;
  #log_seen = -1;
  #ends: (() => void)[] = [];
  readonly #own: boolean;
  #exported = 0;

  /** `own` is the setup of a separate plot; if null, the scope uses the setup stored in this browser. */
  constructor(control: Source, own: Setup | null = null) {
    this.#control = control;
    this.#own = own !== null;
    this.#worker = new Worker(new URL("./worker/worker.ts", import.meta.url), { type: "module" });
    this.#worker.onmessage = (message: MessageEvent<FromWorker>) => this.#take(message.data);
    this.#say({ kind: "texts", ...presentTexts() });
    this.past = control.past;
    const say = (message: ToWorker, transfer?: Transferable[]) => this.#say(message, transfer);
    this.#recorded = this.past && new RecordedFeed(this.past, say, (why) => this.trouble.set(why));
    this.feeds = this.#recorded ?? new Feeds(control.stream, say);
    this.setup = new WatchedValue(own ?? kept());
    const installed = control.topics.installed.latest.watch(() => this.feeds.again(channelsOf(this.setup.get())));
    // Times and numbers start over in another run, so values of the earlier run are discarded.
    const restarts = control.restarts.watch(() => {
      this.#log_seen = -1;
      this.clear();
    });
    this.#ends = [installed, restarts];
    this.#apply(null, this.setup.get());
    const past = this.past;
    if (!past) return;
    this.stopped.set(true);
    this.fit();
    // Keeps the cursor visible.
    const moved = past.cursor.watch(() => {
      const window = this.window.get();
      const at = past.cursor.get();
      if (!window || (at >= window.from_ns && at <= window.to_ns)) return;
      const size = window.to_ns - window.from_ns;
      this.#see({ ...window, from_ns: at - size / 2, to_ns: at + size / 2 });
    });
    this.#ends.push(moved);
  }

  /** Ends the scope and discards all values. */
  end(): void {
    this.feeds.want([]);
    this.#behind?.feed.end();
    this.#whole.over.abort();
    this.#log_end?.();
    for (const end of this.#ends) end();
    this.#worker.terminate();
  }

  /** Changes the setup. */
  change(next: Setup | ((before: Setup) => Setup)): void {
    const before = this.setup.get();
    const after = typeof next === "function" ? next(before) : next;
    if (after === before) return;
    const full = this.#spread(after);
    this.setup.set(full);
    if (!this.#own) keepLast(full);
    this.#apply(before, full);
  }

  /** Sets the receiver of pictures; only one receiver is allowed at a time. */
  onDrawn(shown: (drawn: DrawnTrace) => void): () => void {
    this.#shown = shown;
    return () => {
      if (this.#shown === shown) this.#shown = null;
    };
  }

  show(show: Show): void {
    this.#columns = show.width;
    this.#load();
    this.#say({ kind: "show", show });
  }

  /** Stops storing new values and freezes the picture, or resumes both. */
  stop(stop: boolean): void {
    if (this.past) return;
    this.stopped.set(stop);
    this.#say({ kind: "hold", hold: stop });
    this.window.set(stop ? this.#frozen() : null);
    if (!stop && this.setup.get().sweep !== "roll") this.arm();
  }

  /** Shows this time window, and stops the scope. */
  look(window: Window): void {
    if (window && !this.stopped.get()) this.stop(true);
    this.#see(window);
  }

  /** Shows a span of this length: in a recording around the cursor, otherwise up to the newest value, or around the trigger. */
  showSpan(span_s: number): void {
    const setup = this.setup.get();
    if (span_s !== setup.span_s) this.change({ ...setup, span_s });
    if (this.past) this.#around(span_s);
    else if (this.window.get()) this.fit();
  }

  /** Resets the span to the time base, around time 0; for a recording, to the whole recording. */
  fit(): void {
    if (this.past) {
      const { begins_ns, ends_ns } = this.past;
      this.#see({ from_ns: begins_ns, to_ns: Math.max(ends_ns, begins_ns + 1), origin_ns: 0, triggered: false });
      return;
    }
    const span = this.span;
    if (!span) return;
    const { span_s, pre_s } = this.setup.get();
    const from_ns = span.origin_ns - (span.triggered ? pre_s : span_s) * 1e9;
    this.window.set({ ...span, from_ns, to_ns: from_ns + span_s * 1e9 });
  }

  /** Waits for the next trigger. */
  arm(): void {
    if (this.stopped.get()) {
      this.stopped.set(false);
      this.#say({ kind: "hold", hold: false });
    }
    this.window.set(null);
    this.#say({ kind: "arm" });
  }

  /** Discards all stored values. */
  clear(): void {
    this.#say({ kind: "clear" });
  }

  reference(keep: boolean): void {
    this.#say({ kind: "reference", keep });
  }

  /** Shows another recording behind this one, or, with null, removes it. */
  lay(beside: Beside | null): void {
    const past = this.past;
    if (!past) return;
    const known = this.beside.get();
    this.beside.set(beside);
    if (known?.past !== beside?.past) {
      this.#behind?.feed.end();
      this.#behind = null;
    }
    if (!beside) {
      this.#say({ kind: "beside", shift_ns: null });
      return;
    }
    const say = (message: ToWorker, transfer?: Transferable[]) => this.#say(message, transfer);
    const feed = this.#behind?.feed ?? new RecordedFeed(beside.past, say, (why) => this.trouble.set(why), "beside");
    this.#behind = { feed, shift_ns: shiftOf(past, beside) };
    feed.want(channelsOf(this.setup.get()));
    this.#say({ kind: "beside", shift_ns: this.#behind.shift_ns });
    this.#load();
  }

  /**
   * Exports the picture; CSV and MCAP files contain all values in the visible span. Throws `RefusalError`, or an `Error` with an
   * explanation.
   */
  async export(format: Format): Promise<Blob> {
    const span = this.span;
    if (!span) throw new Error(tr("scope.nothingToExportNoValuesReceived"));
    const { from_ns, to_ns } = { from_ns: Math.ceil(span.from_ns), to_ns: Math.floor(span.to_ns) };
    const apart = this.past !== null && format !== "svg";
    if (this.past && apart) await this.#fetch(this.past, "file", from_ns, to_ns, new AbortController().signal);
    this.#exported += 1;
    const number = this.#exported;
    const done = new Promise<Blob>((done, failed) => this.#exports.set(number, { done, failed }));
    this.#say({ kind: "export", number, format, from_ns, to_ns, system: this.#control.version.system, apart });
    return await done;
  }

  // The screen holds only the values of a recording that its pixels can show.
  async #fetch(past: Past, into: "file" | "whole" | "wholeBeside", from_ns: number, to_ns: number, signal: AbortSignal): Promise<void> {
    const channels = channelsOf(this.setup.get()).flatMap((name) => past.channel(name) ?? []);
    const say = (begins: boolean, runs: Run[]) => this.#say({ kind: "past", into, begins, channels, runs, sums: [] }, buffersOf(runs));
    say(true, []);
    for await (const runs of wholeOf(past, channels, from_ns, to_ns, signal)) {
      if (signal.aborted) return;
      say(false, runs);
    }
  }

  #apply(before: Setup | null, after: Setup): void {
    const same = (...of: (keyof Setup)[]) =>
      before !== null && of.every((key) => JSON.stringify(before[key]) === JSON.stringify(after[key]));
    if (!same("keep_s")) this.#say({ kind: "keep", keep_s: after.keep_s });
    if (!same("sweep", "span_s", "pre_s", "trigger")) {
      const rule = after.trigger?.on === "level" ? after.trigger : null;
      this.#say({ kind: "sweep", mode: after.sweep, span_ns: after.span_s * 1e9, pre_ns: after.pre_s * 1e9, trigger: rule });
      if (!this.stopped.get()) this.window.set(null);
      if (this.past && before !== null && before.span_s !== after.span_s) this.#around(after.span_s);
      if (!this.past) this.#follow(after);
    }
    this.feeds.want(channelsOf(after));
    this.#behind?.feed.want(channelsOf(after));
    this.#loadWhole();
  }

  #columns = 0;

  #see(window: Window): void {
    this.window.set(window);
    this.#load();
  }

  #load(): void {
    const window = this.window.get();
    if (!window) return;
    const { from_ns, to_ns } = window;
    this.#recorded?.look({ from_ns, to_ns, columns: this.#columns });
    const behind = this.#behind;
    behind?.feed.look({ from_ns: from_ns + behind.shift_ns, to_ns: to_ns + behind.shift_ns, columns: this.#columns });
    this.#loadWhole();
  }

  #whole = { asked: "", over: new AbortController() };

  // Spectra of a recording use all of its values, not only those that the pixels can show.
  #loadWhole(): void {
    const past = this.past;
    const window = this.window.get();
    if (!past || !window) return;
    const names = this.setup.get().spectrum ? channelsOf(this.setup.get()) : [];
    const behind = this.beside.get();
    const asked = JSON.stringify([names, window.from_ns, window.to_ns, behind?.past.name, this.#behind?.shift_ns]);
    if (asked === this.#whole.asked) return;
    this.#whole.over.abort();
    this.#whole = { asked, over: new AbortController() };
    const { signal } = this.#whole.over;
    if (names.length === 0) {
      for (const into of ["whole", "wholeBeside"] as const)
        this.#say({ kind: "past", into, begins: true, channels: [], runs: [], sums: [] });
      return;
    }
    const fetch = (of: Past, into: "whole" | "wholeBeside", shift_ns: number) => {
      const [from_ns, to_ns] = [Math.ceil(window.from_ns + shift_ns), Math.floor(window.to_ns + shift_ns)];
      const attempts = new Attempts();
      let told = "";
      const clear = () => {
        if (told !== "" && this.trouble.get() === told) this.trouble.set("");
      };
      signal.addEventListener("abort", clear);
      const attempt = () => {
        this.#fetch(of, into, Math.max(of.begins_ns, from_ns), Math.min(of.ends_ns, to_ns), signal).then(
          () => signal.aborted || clear(),
          (why) => {
            if (signal.aborted) return;
            told = why instanceof Error ? why.message : String(why);
            this.trouble.set(told);
            const wait_ms = attempts.againAfter_ms(why);
            if (wait_ms !== null) setTimeout(() => signal.aborted || attempt(), wait_ms);
          },
        );
      };
      attempt();
    };
    fetch(past, "whole", 0);
    if (behind && this.#behind) fetch(behind.past, "wholeBeside", this.#behind.shift_ns);
  }

  // In a recording, the time base is centred on the cursor.
  #around(span_s: number): void {
    if (!this.past) return;
    const from_ns = this.past.cursor.get() - span_s * 0.5e9;
    this.#see({ from_ns, to_ns: from_ns + span_s * 1e9, origin_ns: 0, triggered: false });
  }

  // The log is followed only while a log entry is the trigger.
  #follow({ trigger, sweep }: Setup): void {
    const wanted = trigger?.on === "event" && sweep !== "roll";
    if (wanted && !this.#log_end) {
      const log = this.#control.topics.log;
      this.#log_seen = log.get()?.entries.at(-1)?.sequence ?? -1;
      const asked_s = this.#control.topics.statistics.get()?.now_s ?? Number.NEGATIVE_INFINITY;
      this.#log_end = log.watch(() => this.#logged(log.get()?.entries ?? [], asked_s));
    }
    if (!wanted) {
      this.#log_end?.();
      this.#log_end = null;
    }
  }

  #logged(entries: readonly LogEntry[], since_s: number): void {
    const trigger = this.setup.get().trigger;
    if (trigger?.on !== "event") return;
    for (const entry of entries) {
      if (entry.sequence <= this.#log_seen) continue;
      this.#log_seen = entry.sequence;
      const fits =
        entry.kind === trigger.kind && (trigger.about === "" || entry.about.includes(trigger.about)) && entry.text.includes(trigger.text);
      if (fits && entry.time_s >= since_s) this.#say({ kind: "event", time_ns: Math.round(entry.time_s * 1e9) });
    }
  }

  #take(said: FromWorker): void {
    switch (said.kind) {
      case "channels":
        this.channels.set(new Map(said.channels.map((channel) => [channel.name, channel])));
        this.change((setup) => this.#spread(setup));
        break;
      case "trouble":
        this.trouble.set(said.message);
        break;
      case "exported": {
        const one = this.#exports.get(said.number);
        this.#exports.delete(said.number);
        said.blob ? one?.done(said.blob) : one?.failed(new Error(said.message));
        break;
      }
      case "drawn":
        this.#drawn(said);
        break;
    }
  }

  #drawn(drawn: DrawnTrace): void {
    this.span = drawn.span;
    this.along = drawn.x;
    if (drawn.rows) this.rows.set(drawn.rows);
    if (drawn.counts) this.counts.set(drawn.counts);
    const { state, triggers, has_reference } = drawn;
    const triggered = drawn.span?.triggered ?? false;
    const old = this.status.get();
    if (old.state !== state || old.triggers !== triggers || old.has_reference !== has_reference || old.triggered !== triggered) {
      this.status.set({ state, triggers, has_reference, triggered });
    }
    if (this.#shown) this.#shown(drawn);
    else drawn.bitmap.close();
    // After painting: slow machines and pages in the background get fewer pictures, but lose no values.
    requestAnimationFrame(() => requestAnimationFrame(() => this.#say({ kind: "seen" })));
  }

  // A channel chosen as a whole gets a trace for each component when their number is known.
  #spread(setup: Setup): Setup {
    if (!setup.traces.some((trace) => trace.component === null && this.channels.get().has(trace.channel))) return setup;
    const used = new Set(setup.traces.filter((trace) => trace.component !== null).map((trace) => trace.look));
    const next = (wanted: number) => {
      let look = wanted;
      while (used.has(look)) look += 1;
      used.add(look);
      return look;
    };
    const traces = setup.traces.flatMap((trace): TraceSetup[] => {
      const about = this.channels.get().get(trace.channel);
      if (trace.component !== null || !about) return [trace];
      return componentNames(about.type_text, about.components).map((component) => ({ ...trace, component, look: next(trace.look) }));
    });
    return { ...setup, traces };
  }

  #frozen(): Window {
    return this.span && { ...this.span };
  }

  #say(message: ToWorker, transfer: Transferable[] = []): void {
    this.#worker.postMessage(message, { transfer });
  }
}

const scopes = new WeakMap<Source, Scope>();

/** Returns the scope of a source, created on first use. */
export function scopeOf(control: Source): Scope {
  const known = scopes.get(control);
  if (known) return known;
  const made = new Scope(control);
  scopes.set(control, made);
  return made;
}
