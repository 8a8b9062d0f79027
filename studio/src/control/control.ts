// SPDX-License-Identifier: Apache-2.0
import { LiveValues } from "../live/values";
import { Alarming } from "./alarming";
import { type Asides, call, type Looks, type Orders, type Stops, stop } from "./calls";
import { Command, may } from "./command";
import { RefusalError, unconnected } from "./refusals";
import { type Asker, answer, request } from "./requests";
import { Session } from "./session";
import type { Role, Version } from "./shapes";
import type { PressTime, Source } from "./source";
import { StartedInstances } from "./started";
import { Stream } from "./stream";
import { Topics } from "./topics";
import { WatchedValue } from "./watched";

/** The real-time system, as the page sees it: looking, commanding, and what comes by itself. */
export class Control implements Source {
  /** Version of the system that answers; another one when the system was started again. */
  readonly met: WatchedValue<Version>;
  /** Number of times that the system was started again since the page was opened. */
  readonly restarts = new WatchedValue(0);
  readonly session: Session;
  readonly command: Command;
  readonly stream: Stream;
  readonly topics: Topics;
  readonly values: LiveValues;
  readonly started = new StartedInstances();
  readonly alarms: Alarming;
  readonly past = null;
  readonly #asker: Asker;

  constructor(token: string | null, version: Version) {
    this.met = new WatchedValue(version);
    this.#asker = { token, session: null };
    this.session = new Session(this.#asker);
    this.command = new Command(this.#asker, this.session.name.get);
    this.stream = new Stream(
      () => ({ url: `${window.location.origin.replace(/^http/, "ws")}/v1/stream?beat=true`, token }),
      () => this.#meet(),
    );
    this.topics = new Topics(this.stream);
    this.values = new LiveValues(this.stream);
    this.alarms = new Alarming(() => this.look("alarms", {}));
  }

  get origin(): Source {
    return this;
  }

  get version(): Version {
    return this.met.get();
  }

  get role(): Role {
    return this.version.role ?? "observe";
  }

  may(role: Role): boolean {
    return may(this.role, role);
  }

  open(): void {
    this.stream.open();
    void this.session.open();
    this.command.follow();
    this.alarms.follow();
    // Where the system was started again, it knows nothing of the session.
    this.stream.connection.watch(() => {
      if (this.stream.connection.get() === "open" && this.session.name.get() === null) void this.session.open();
    });
  }

  close(): void {
    this.stream.close();
    this.command.stop();
    this.alarms.stop();
  }

  /** Makes a call that only looks. Errors: `RefusalError`. */
  look<N extends keyof Looks>(name: N, args: Looks[N][0], signal?: AbortSignal): Promise<Looks[N][1]> {
    return this.#sure(() => call<Looks[N][1]>(this.#asker, name, args, signal));
  }

  /** When the person gave the command that is being made: the time of the event that is handled now, or now. */
  pressed(): PressTime {
    const event = window.event;
    return this.stream.daemon_ms(event?.isTrusted ? event.timeStamp : performance.now());
  }

  /**
   * Makes a call that commands; takes command first. The daemon refuses it where it comes later than half a second after `pressed`, which
   * is the beginning of the call where nothing else is given. Errors: `RefusalError`.
   */
  async order<N extends keyof Orders>(
    name: N,
    args: Orders[N][0],
    signal?: AbortSignal,
    pressed: PressTime = this.pressed(),
  ): Promise<Orders[N][1]> {
    if (pressed === null) throw unconnected();
    await this.session.open();
    const given = () => call<Orders[N][1]>({ ...this.#asker, asOf: pressed, isFirst: true }, name, args, signal);
    const done = await this.#sure(() => this.command.with(given));
    if (name === "start") this.started.add((args as Orders["start"][0]).instance);
    if (name === "create") this.started.make(done as Orders["create"][1]);
    return done;
  }

  /** Makes a call that leaves the machine alone: it neither needs command nor takes it. Errors: `RefusalError`. */
  async aside<N extends keyof Asides>(name: N, args: Asides[N][0]): Promise<Asides[N][1]> {
    await this.session.open();
    return this.#sure(() => call<Asides[N][1]>(this.#asker, name, args));
  }

  /** Stops something. It neither needs command nor takes it: who may operate may stop. Errors: `RefusalError`. */
  stop<N extends keyof Stops>(name: N, args: Stops[N][0]): Promise<void> {
    return this.#sure(() => stop({ ...this.#asker, isFirst: true }, name, args));
  }

  /** Stops everything at once: needs the role `operate`, and no command. */
  async emergencyStop(reason: string, signal?: AbortSignal): Promise<null> {
    try {
      return await call<null>({ ...this.#asker, isUrgent: true }, "emergency_stop", { reason }, signal);
    } catch (why) {
      // It needs no session: none is opened before it.
      if (!(why instanceof RefusalError && why.is("SessionLost"))) throw why;
      return await call<null>({ token: this.#asker.token, session: null, isUrgent: true }, "emergency_stop", { reason }, signal);
    }
  }

  get<T>(path: string): Promise<T> {
    return this.#sure(() => request<T>(this.#asker, "GET", path));
  }

  /** Asks which run of the system answers. Of another one than before nothing is known yet, and what was known is of an earlier run. */
  async #meet(): Promise<void> {
    const version = await answer<Version>(this.#asker, "GET", "/v1/version");
    const isAnother = version.run !== this.version.run;
    this.met.set(version);
    if (!isAnother) return;
    this.topics.renew();
    this.values.forget();
    this.started.forget();
    this.restarts.set(this.restarts.get() + 1);
  }

  /** A session that was lost is opened again, once. */
  async #sure<T>(asked: () => Promise<T>): Promise<T> {
    try {
      return await asked();
    } catch (why) {
      if (!(why instanceof RefusalError && why.is("SessionLost"))) throw why;
      await this.session.renew();
      return await asked();
    }
  }
}

/** Asks who is there, with this token. Errors: `RefusalError`; 401 where the token is not known. */
export async function connect(token: string | null): Promise<Control> {
  const asker: Asker = { token, session: null };
  const version = await answer<Version>(asker, "GET", "/v1/version");
  return new Control(token, version);
}
