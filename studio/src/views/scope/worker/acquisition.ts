// SPDX-License-Identifier: Apache-2.0
import type { RecordedSums as Sums } from "../../../control/shapes";
import type { ChannelCounts, TriggerRule } from "../messages";
import { componentNames } from "../signal/components";
import { decodeFrame, MalformedFrame, type Run, type StreamChannel } from "../signal/frame";
import { spreadOf } from "../signal/measure";
import { Ring } from "../signal/ring";
import { Sweep, type SweepMode } from "../signal/sweep";
import { EdgeFinder } from "../signal/trigger";

export interface KeptChannel {
  about: StreamChannel;
  ring: Ring;
  components: string[];
}

export function sumsKey(channel: string, component: string): string {
  return `${channel} ${component}`;
}

function added(before: Sums | undefined, more: Sums): Sums {
  if (!before || before.count === 0) return more;
  if (more.count === 0) return before;
  return {
    count: before.count + more.count,
    min: Math.min(before.min, more.min),
    max: Math.max(before.max, more.max),
    sum: before.sum + more.sum,
    squares: before.squares + more.squares,
    spread: spreadOf(before, more),
  };
}

/** Maximum total memory of all rings, bytes. */
const BYTES_MAX = 512 * 2 ** 20;

/** Acquisition of values from the stream: stores and counts the values of each channel, and searches them for the trigger. */
export class Acquisition {
  readonly channels = new Map<string, KeptChannel>();
  sweep = new Sweep("roll", 5e9, 0);
  hold = false;
  /** Sums over all values in the span of a recording, including values that were not sent, by channel and component. */
  readonly sums = new Map<string, Sums>();
  /** Number of malformed frames. */
  malformed = 0;
  readonly #subscriptions = new Map<number, StreamChannel[]>();
  #keep_ns = 60e9;
  #finder: { rule: TriggerRule; edge: EdgeFinder } | null = null;
  #held_from_ns = Number.POSITIVE_INFINITY;

  /** Called when a subscription has started, or has resumed after a reconnection. */
  subscribed(subscription: number, channels: StreamChannel[]): void {
    this.#subscriptions.set(subscription, channels);
    for (const about of channels) {
      const known = this.channels.get(about.name);
      if (known && known.about.type_text === about.type_text && known.about.components === about.components) known.ring.resume();
      else {
        const ring = new Ring(about.components, this.#keep_ns, 1);
        this.channels.set(about.name, { about, ring, components: componentNames(about.type_text, about.components) });
      }
    }
    this.#share();
  }

  /** Adds a section of a span of a recording; if `begins`, it replaces all stored values. */
  past(begins: boolean, channels: readonly StreamChannel[], runs: readonly Run[], sums: readonly Sums[][]): void {
    if (begins) {
      this.channels.clear();
      this.sums.clear();
      for (const about of channels) {
        const ring = new Ring(about.components, Number.POSITIVE_INFINITY, Number.MAX_SAFE_INTEGER);
        this.channels.set(about.name, { about, ring, components: componentNames(about.type_text, about.components) });
      }
    }
    for (const run of runs) {
      const kept = this.channels.get(channels[run.channel]?.name ?? "");
      kept?.ring.take(run);
      kept?.components.forEach((component, i) => {
        const more = sums[run.channel]?.[i];
        const key = sumsKey(kept.about.name, component);
        if (more) this.sums.set(key, added(this.sums.get(key), more));
      });
    }
  }

  forget(names: readonly string[]): void {
    for (const name of names) this.channels.delete(name);
    this.#share();
  }

  keep(keep_ns: number): void {
    this.#keep_ns = keep_ns;
    this.#share();
  }

  clear(): void {
    for (const { ring } of this.channels.values()) ring.clear();
    this.aim(this.sweep.mode, this.sweep.span_ns, this.sweep.pre_ns, this.#finder?.rule ?? null);
    this.stop(this.hold);
  }

  aim(mode: SweepMode, span_ns: number, pre_ns: number, rule: TriggerRule | null): void {
    const newest = this.newest_ns();
    this.sweep = new Sweep(mode, span_ns, pre_ns, newest === null ? undefined : this.sweep);
    this.#finder = rule && { rule, edge: new EdgeFinder(rule.edge, rule.level, rule.hysteresis) };
    if (newest !== null) {
      this.sweep.arm(newest);
      this.sweep.reached(newest);
    }
  }

  arm(): void {
    this.sweep.arm(this.newest_ns() ?? Number.NEGATIVE_INFINITY);
  }

  /** Stops storing new values, or resumes. */
  stop(hold: boolean): void {
    this.hold = hold;
    this.#held_from_ns = hold ? (this.newest_ns() ?? Number.NEGATIVE_INFINITY) : Number.POSITIVE_INFINITY;
  }

  event(time_ns: number): void {
    if (!this.hold) this.sweep.triggered(time_ns);
  }

  /** Adds the values of a frame. Throws `MalformedFrame`, without adding any values, if the frame is malformed. */
  frame(subscription: number, buffer: ArrayBuffer): void {
    const channels = this.#subscriptions.get(subscription);
    if (!channels) return;
    let runs: Run[];
    try {
      runs = decodeFrame(new DataView(buffer), channels);
    } catch (why) {
      if (why instanceof MalformedFrame) this.malformed += 1;
      throw why;
    }
    const until_ns = this.#until_ns();
    for (const run of runs) this.#take((channels[run.channel] as StreamChannel).name, run, until_ns);
    const newest = this.newest_ns();
    if (newest !== null) this.sweep.reached(newest);
  }

  /** Returns the time of the latest stored value of any channel. */
  newest_ns(): number | null {
    let newest: number | null = null;
    for (const { ring } of this.channels.values()) {
      const of = ring.newest_ns;
      if (of !== null && (newest === null || of > newest)) newest = of;
    }
    return newest;
  }

  counts(): ChannelCounts[] {
    return [...this.channels].map(([name, { ring }]) => ({
      name,
      ...ring.counts,
      numbered: ring.numbered,
      kept: ring.end - ring.first,
      kept_s: ring.end > ring.first ? ((ring.newest_ns as number) - (ring.oldest_ns as number)) / 1e9 : 0,
      bytes: ring.bytes,
    }));
  }

  // After a complete sweep, and while the scope is stopped, new values are not stored.
  #until_ns(): number {
    const span = this.sweep.stopped ? this.sweep.span() : null;
    return Math.min(this.#held_from_ns, span ? span.to_ns : Number.POSITIVE_INFINITY);
  }

  #take(name: string, run: Run, until_ns: number): void {
    const kept = this.channels.get(name);
    if (!kept) return;
    const { ring } = kept;
    const last = ring.newest_ns;
    // If time jumps back, the system was restarted, and the previous values belong to another run.
    if (last !== null && run.times_ns.length > 0 && (run.times_ns[0] as number) < last) {
      this.clear();
    }
    const from = ring.end;
    ring.take(run, until_ns);
    if (this.#finder?.rule.channel === name) this.#search(kept, from);
  }

  #search({ ring, components }: KeptChannel, from: number): void {
    const finder = this.#finder;
    const component = components.indexOf(finder?.rule.component ?? "");
    if (!finder || component < 0) return;
    const gaps = new Set(ring.gaps.filter((gap) => gap.before >= from).map((gap) => gap.before));
    for (let i = Math.max(from, ring.first); i < ring.end; i += 1) {
      if (gaps.has(i)) finder.edge.gap();
      const time_ns = ring.time_ns(i);
      this.sweep.reached(time_ns);
      const crossed = finder.edge.next(time_ns, ring.value(i, component));
      if (crossed !== null) this.sweep.triggered(crossed);
    }
  }

  #share(): void {
    let columns = 0;
    for (const { ring } of this.channels.values()) columns += 1 + ring.components;
    for (const { ring } of this.channels.values()) {
      ring.keep_ns = this.#keep_ns;
      ring.capacity_max = Math.max(1024, Math.floor(BYTES_MAX / 8 / Math.max(1, columns)));
    }
  }
}
