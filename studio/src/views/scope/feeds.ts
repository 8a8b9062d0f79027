// SPDX-License-Identifier: Apache-2.0
import type { Refusal } from "../../control/refusals";
import type { Stream } from "../../control/stream";
import { WatchedValue } from "../../control/watched";
import type { ToWorker } from "./messages";
import type { StreamChannel } from "./signal/frame";

/** Period of frames, ms: a compromise between smooth display and the load on the page. */
const EVERY_MS = 50;
/** Maximum number of subscriptions of the scope; all other views share the rest of the 16. */
const FEEDS_MAX = 8;

interface Feed {
  names: Set<string>;
  end: () => void;
}

/** Source of the scope's channels. */
export interface Feeding {
  /** Refusals by channel. */
  readonly refused: WatchedValue<ReadonlyMap<string, Refusal[]>>;
  /** Requests exactly these channels. */
  want(names: readonly string[]): void;
  /** Requests refused channels again, because an installation may have added them. */
  again(names: readonly string[]): void;
}

/**
 * The scope's channels from the stream. An added channel gets its own subscription, so that no values of the other channels are lost. If
 * there are too many subscriptions, all channels are merged into one.
 */
export class Feeds implements Feeding {
  /** Refusals of the system, by channel. */
  readonly refused = new WatchedValue<ReadonlyMap<string, Refusal[]>>(new Map());
  readonly #stream: Pick<Stream, "subscribe">;
  readonly #say: (message: ToWorker, transfer?: Transferable[]) => void;
  readonly #feeds = new Map<number, Feed>();
  #last = 0;

  constructor(stream: Pick<Stream, "subscribe">, say: (message: ToWorker, transfer?: Transferable[]) => void) {
    this.#stream = stream;
    this.#say = say;
  }

  /** Requests exactly these channels. */
  want(names: readonly string[]): void {
    const wanted = new Set(names);
    const gone: string[] = [];
    for (const [number, feed] of this.#feeds) {
      for (const name of feed.names) {
        if (wanted.has(name)) continue;
        feed.names.delete(name);
        gone.push(name);
      }
      if (feed.names.size > 0) continue;
      feed.end();
      this.#feeds.delete(number);
    }
    if (gone.length > 0) this.#say({ kind: "forget", channels: gone });
    this.#forgive((name) => !wanted.has(name));
    const has = new Set([...this.#feeds.values()].flatMap((feed) => [...feed.names]));
    const more = names.filter((name) => !has.has(name) && !this.refused.get().has(name));
    if (more.length === 0) return;
    if (this.#feeds.size < FEEDS_MAX) this.#subscribe(more);
    else this.#subscribeAll([...has, ...more]);
  }

  /** Requests refused channels again, because an installation may have added them. */
  again(names: readonly string[]): void {
    if (this.refused.get().size === 0) return;
    this.#forgive(() => true);
    this.want(names);
  }

  #subscribeAll(names: string[]): void {
    for (const feed of this.#feeds.values()) feed.end();
    this.#feeds.clear();
    this.#subscribe(names);
  }

  #subscribe(names: string[]): void {
    this.#last += 1;
    const number = this.#last;
    let channels: StreamChannel[] = [];
    let heard = false;
    const end = this.#stream.subscribe(
      { subscribe: "scope", names, every_ms: EVERY_MS },
      {
        text: (frame) => {
          channels = (frame.scope as { channels: StreamChannel[] }).channels;
          this.#say({ kind: "subscribed", subscription: number, channels, again: heard });
          heard = true;
          // Channels that are no longer requested, but are still part of the subscription.
          const unwanted = channels.map((channel) => channel.name).filter((name) => !this.#feeds.get(number)?.names.has(name));
          if (unwanted.length > 0) this.#say({ kind: "forget", channels: unwanted });
        },
        binary: (frame) =>
          this.#say({ kind: "frame", subscription: number, buffer: frame.buffer as ArrayBuffer }, [frame.buffer as ArrayBuffer]),
        refused: (refusals) => this.#refuse(number, refusals),
        again: () => ({ subscribe: "scope", names: [...(this.#feeds.get(number)?.names ?? names)], every_ms: EVERY_MS }),
      },
    );
    this.#feeds.set(number, { names: new Set(names), end });
  }

  // One unknown name causes the whole subscription to be refused: the other channels are requested again without it.
  #refuse(number: number, refusals: Refusal[]): void {
    const names = [...(this.#feeds.get(number)?.names ?? [])];
    this.#feeds.delete(number);
    const named = names.filter((name) => refusals.some((refusal) => refusal.message.includes(`'${name}'`)));
    const out = named.length > 0 ? named : names;
    const refused = new Map(this.refused.get());
    for (const name of out) {
      const own = refusals.filter((refusal) => refusal.message.includes(`'${name}'`));
      refused.set(name, own.length > 0 ? own : refusals);
    }
    this.refused.set(refused);
    const rest = names.filter((name) => !out.includes(name));
    if (rest.length > 0) this.#subscribe(rest);
  }

  #forgive(which: (name: string) => boolean): void {
    const before = this.refused.get();
    const left = new Map([...before].filter(([name]) => !which(name)));
    if (left.size !== before.size) this.refused.set(left);
  }
}
