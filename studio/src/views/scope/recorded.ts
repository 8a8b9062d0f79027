// SPDX-License-Identifier: Apache-2.0

import { Attempts } from "../../control/asking";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { RecordedSpan } from "../../control/shapes";
import type { Past } from "../../control/source";
import { WatchedValue } from "../../control/watched";
import { tr } from "../../language/text";
import type { Feeding } from "./feeds";
import type { Into, ToWorker } from "./messages";
import type { Run, StreamChannel } from "./signal/frame";

/** Requested section of a recording: times, and the width in pixels. */
export interface RequestedSpan {
  from_ns: number;
  to_ns: number;
  columns: number;
}

/**
 * The scope's channels from a recording, requested again whenever the span or the channels change. If there are more values per pixel
 * than can be shown, the system sends only the first, last, minimum and maximum, with exact sums of all values.
 */
export class RecordedFeed implements Feeding {
  readonly refused = new WatchedValue<ReadonlyMap<string, Refusal[]>>(new Map());
  readonly #past: Past;
  readonly #say: (message: ToWorker, transfer?: Transferable[]) => void;
  readonly #failed: (why: string) => void;
  readonly #into: Into;
  #names: readonly string[] = [];
  #wanted: RequestedSpan | null = null;
  #asked = "";
  #over = new AbortController();
  #attempts = new Attempts();
  #again: ReturnType<typeof setTimeout> | undefined;

  /** `into` is the destination in the worker. */
  constructor(
    past: Past,
    say: (message: ToWorker, transfer?: Transferable[]) => void,
    failed: (why: string) => void,
    into: Into = "shown",
  ) {
    this.#past = past;
    this.#into = into;
    this.#say = say;
    this.#failed = failed;
  }

  want(names: readonly string[]): void {
    this.#names = names;
    const none = names.filter((name) => !this.#past.channel(name));
    const why = (name: string): Refusal[] => [{ class: "NotRecorded", message: tr("scope.nameIsNotInTheRecording", { name }) }];
    this.refused.set(new Map(none.map((name) => [name, why(name)])));
    this.#ask();
  }

  /** Requests a different span. */
  look(wanted: RequestedSpan): void {
    this.#wanted = wanted;
    this.#ask();
  }

  again(): void {}

  /** Cancels all requests. */
  end(): void {
    clearTimeout(this.#again);
    this.#over.abort();
  }

  #ask(): void {
    const wanted = this.#wanted;
    const channels = this.#names.flatMap((name) => this.#past.channel(name) ?? []);
    const asked = JSON.stringify([wanted, channels.map((channel) => channel.name)]);
    if (!wanted || wanted.columns < 1 || asked === this.#asked) return;
    this.#asked = asked;
    this.end();
    this.#over = new AbortController();
    this.#attempts = new Attempts();
    void this.#load(channels, wanted, this.#over.signal);
  }

  async #load(channels: StreamChannel[], wanted: RequestedSpan, signal: AbortSignal): Promise<void> {
    const names = channels.map((channel) => channel.name);
    try {
      let begins = true;
      if (names.length === 0) this.#say({ kind: "past", into: this.#into, begins, channels, runs: [], sums: [] });
      else {
        for await (const part of this.#past.span(names, wanted.from_ns, wanted.to_ns, wanted.columns, signal)) {
          if (signal.aborted) return;
          const runs = runsOf(part, channels);
          const sums = part.channels.map((channel) => channel.sums);
          this.#say({ kind: "past", into: this.#into, begins, channels, runs, sums }, buffersOf(runs));
          begins = false;
        }
      }
      this.#failed("");
    } catch (why) {
      if (signal.aborted) return;
      this.#failed(
        refusalsOf(why)
          .map((one) => one.message)
          .join("; "),
      );
      const wait_ms = this.#attempts.againAfter_ms(why);
      if (wait_ms !== null) this.#again = setTimeout(() => void this.#load(channels, wanted, signal), wait_ms);
    }
  }
}

/** Returns the buffers to be transferred with a message. */
export function buffersOf(runs: readonly Run[]): Transferable[] {
  return runs.flatMap(({ times_ns, numbers, values }) => [times_ns.buffer, numbers.buffer, values.buffer] as Transferable[]);
}

/**
 * Decodes a section of a recording: base64 of the (i64 time, u64 number) pairs of all samples, followed by their components as f64, all
 * little-endian.
 */
export function runsOf(part: Pick<RecordedSpan, "channels">, channels: readonly StreamChannel[]): Run[] {
  return part.channels.map(({ samples }, channel) => {
    const bytes = Uint8Array.from(atob(samples), (letter) => letter.charCodeAt(0));
    const components = channels[channel]?.components ?? 1;
    const count = bytes.length / (16 + 8 * components);
    const view = new DataView(bytes.buffer);
    const [times_ns, numbers] = [new Float64Array(count), new Float64Array(count)];
    for (let at = 0; at < count; at += 1) {
      times_ns[at] = Number(view.getBigInt64(16 * at, true));
      numbers[at] = Number(view.getBigUint64(16 * at + 8, true));
    }
    const values = new Float64Array(count * components);
    for (let at = 0; at < values.length; at += 1) values[at] = view.getFloat64(16 * count + 8 * at, true);
    return { channel, lost: 0, times_ns, numbers, values };
  });
}
