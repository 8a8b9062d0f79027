// SPDX-License-Identifier: Apache-2.0
import { Beats } from "./beats";
import { type Refusal, RefusalError } from "./refusals";
import { WatchedValue } from "./watched";

/** Subscription request, without its `id`, which the stream assigns. */
export type Topic =
  | { subscribe: "svvs"; names: string[]; every_ms: number }
  | { subscribe: "log"; since: number }
  | { subscribe: "ends"; since: number }
  | { subscribe: "scope"; names: string[]; every_ms: number }
  | { subscribe: "statistics"; every_ms: number }
  | { subscribe: "installed" };

/** Receiver of a subscription's frames. */
export interface Subscriber {
  /** Receives a text frame, as sent by the system. */
  text(frame: Record<string, unknown>): void;
  /** Receives a binary frame (topic `scope`): the whole frame, and the offset of its body. */
  binary?(frame: DataView, body: number): void;
  /** Called when the system has refused the subscription and thereby ended it. */
  refused(refusals: Refusal[]): void;
  /** Returns the topic to request after a reconnection; by default the same topic as before. */
  again?(): Topic;
}

/**
 * State of the connection. `silent`: no beat has arrived for longer than the heartbeat allows, although the connection was not closed.
 * `out`: the system does not accept, or no longer accepts, this page's token; the page does not retry.
 */
export type Connection = "connecting" | "open" | "silent" | "broken" | "out";

const PROTOCOL = "opengpac.v1";
/** Magic number: the first four bytes of a binary frame. */
export const MAGIC = 0x47534331;
/**
 * Close code of a stream whose caller is no longer authenticated, because its token was revoked or has expired, or because its role has
 * changed.
 */
const SHUT_OUT = 4401;
const AGAIN_MS = [250, 500, 1000, 2000, 4000];
/** First the period at which the age of the latest beat is checked, and then the maximum age, ms. A beat is sent every 250 ms. */
const LOOK_MS = 100;
const SILENT_MS = 750;
/** Age at which a silent connection is closed and reopened, ms. */
const GIVE_UP_MS = 4000;

/**
 * The event stream of the system: one WebSocket, reopened with all subscriptions whenever it breaks.
 *
 * The system allows 16 subscriptions, so views share theirs where possible (`topics.ts`, `live/values.ts`).
 */
export class Stream {
  readonly connection = new WatchedValue<Connection>("connecting");
  readonly #url: () => { url: string; token: string | null };
  readonly #met: (() => Promise<void>) | null;
  readonly #subscriptions = new Map<string, { topic: Topic; subscriber: Subscriber }>();
  #socket: WebSocket | null = null;
  /** Socket to the run of the system that has been identified. Frames are sent only over this socket. */
  #known: WebSocket | null = null;
  #last = 0;
  #failures = 0;
  #again: ReturnType<typeof setTimeout> | undefined;
  #closed = false;
  readonly #beats = new Beats();
  #looking: ReturnType<typeof setInterval> | undefined;
  #looked = 0;
  /** Local time at which the current socket was opened. A silent socket is closed only after it has been open for `GIVE_UP_MS`. */
  #opened = 0;

  /** `met` is called whenever a connection opens, before any subscription, to identify the run that answers. */
  constructor(url: () => { url: string; token: string | null }, met: (() => Promise<void>) | null = null) {
    this.#url = url;
    this.#met = met;
  }

  /** Subscribes until the returned function is called. */
  subscribe(topic: Topic, subscriber: Subscriber): () => void {
    this.#last += 1;
    const id = `${topic.subscribe}-${this.#last}`;
    this.#subscriptions.set(id, { topic, subscriber });
    this.#say({ ...topic, id });
    return () => {
      if (this.#subscriptions.delete(id)) this.#say({ unsubscribe: id });
    };
  }

  /** Returns the age of the last known state of the system, ms. */
  age_ms(): number {
    return this.#beats.age_ms(performance.now());
  }

  /** Converts a local time (`performance.now()`) to the daemon's time, ms; null without an open connection. */
  daemon_ms(local_ms: number): number | null {
    return this.connection.get() === "open" ? this.#beats.daemon_ms(local_ms) : null;
  }

  open(): void {
    this.#closed = false;
    this.#beats.forget();
    this.#opened = performance.now();
    clearInterval(this.#looking);
    this.#looked = performance.now();
    this.#looking = setInterval(() => this.#look(), LOOK_MS);
    const { url, token } = this.#url();
    const socket = new WebSocket(url, token ? [PROTOCOL, `bearer.${token}`] : [PROTOCOL]);
    socket.binaryType = "arraybuffer";
    const begin = () => {
      if (this.#socket !== socket || socket.readyState !== WebSocket.OPEN) return;
      this.#failures = 0;
      this.#known = socket;
      for (const [id, subscription] of this.#subscriptions) {
        subscription.topic = subscription.subscriber.again?.() ?? subscription.topic;
        this.#say({ ...subscription.topic, id });
      }
      this.#heard(performance.now());
    };
    // If the socket closes before the run is identified, the next connection identifies it again.
    socket.onopen = () => void (this.#met ? this.#met().then(begin, () => socket.close()) : begin());
    socket.onmessage = (message: MessageEvent<string | ArrayBuffer>) => {
      if (this.#socket !== socket) return;
      if (typeof message.data === "string") this.#text(message.data);
      else this.#binary(message.data);
    };
    socket.onclose = (end?: CloseEvent) => {
      if (this.#socket !== socket) return;
      const wasKnown = this.#known === socket;
      this.#broken(end);
      if (!wasKnown) this.#askWhy(socket);
    };
    this.#socket = socket;
  }

  close(): void {
    this.#closed = true;
    clearTimeout(this.#again);
    clearInterval(this.#looking);
    this.#socket?.close();
  }

  /**
   * Checks with an ordinary request whether the system refuses this page's token, because a browser does not report why a WebSocket
   * failed.
   */
  #askWhy(refused: WebSocket): void {
    this.#met?.().catch((why) => {
      if (!(why instanceof RefusalError && why.status === 401) || this.#socket !== refused) return;
      clearTimeout(this.#again);
      this.connection.set("out");
    });
  }

  /** Checks the age of the latest beat. If the browser itself was busy, it first gets time to process pending frames. */
  #look(): void {
    const now = performance.now();
    const wasBusy = now - this.#looked > 3 * LOOK_MS;
    this.#looked = now;
    const age_ms = this.#beats.age_ms(now);
    if (wasBusy || age_ms <= SILENT_MS) return;
    if (this.connection.get() === "open") this.connection.set("silent");
    if (Math.min(age_ms, now - this.#opened) <= GIVE_UP_MS || !this.#socket) return;
    const given = this.#socket;
    this.#socket = null;
    this.#known = null;
    given.close();
    this.#broken();
  }

  #beat(beat_ms: number): void {
    const now = performance.now();
    this.#beats.hear(beat_ms, now);
    this.#heard(now);
  }

  /**
   * Marks the connection as open once the run is identified and a beat has arrived with the daemon's time. Commands can then include the
   * time at which they were given.
   */
  #heard(now: number): void {
    const isHeard = this.#known === this.#socket && this.#beats.daemon_ms(now) !== null && this.#beats.age_ms(now) <= SILENT_MS;
    if (isHeard && this.connection.get() !== "open") this.connection.set("open");
  }

  #say(frame: object): void {
    if (this.#socket?.readyState === WebSocket.OPEN && this.#known === this.#socket) this.#socket.send(JSON.stringify(frame));
  }

  #broken(end?: CloseEvent): void {
    clearInterval(this.#looking);
    const isOut = end?.code === SHUT_OUT;
    this.connection.set(isOut ? "out" : "broken");
    if (this.#closed || isOut) return;
    clearTimeout(this.#again);
    const wait = AGAIN_MS[Math.min(this.#failures, AGAIN_MS.length - 1)];
    this.#failures += 1;
    this.#again = setTimeout(() => this.open(), wait);
  }

  #text(text: string): void {
    const frame = JSON.parse(text) as Record<string, unknown>;
    if (typeof frame.beat === "number") {
      this.#beat(frame.beat);
      return;
    }
    const subscription = this.#subscriptions.get(String(frame.id));
    if (!subscription) return;
    if (frame.errors) {
      this.#subscriptions.delete(String(frame.id));
      subscription.subscriber.refused(frame.errors as Refusal[]);
    } else {
      subscription.subscriber.text(frame);
    }
  }

  #binary(data: ArrayBuffer): void {
    const frame = new DataView(data);
    if (frame.byteLength < 8 || frame.getUint32(0, true) !== MAGIC) return;
    const length = frame.getUint32(4, true);
    const id = new TextDecoder().decode(new Uint8Array(data, 8, length));
    this.#subscriptions.get(id)?.subscriber.binary?.(frame, 8 + 8 * Math.ceil(length / 8));
  }
}
