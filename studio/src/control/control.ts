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

/** The real-time system as seen by the page: reads, commands, and topics. */
export class Control implements Source {
  /** Version of the system that answers; changes when the system restarts. */
  readonly met: WatchedValue<Version>;
  /** Number of restarts of the system since the page was opened. */
  readonly restarts = new WatchedValue(0);
  readonly session: Session;
  readonly command: Command;
  readonly stream: Stream;
  readonly topics: Topics;
  readonly values: LiveValues;
  readonly started: StartedInstances;
  readonly alarms: Alarming;
  readonly past = null;
  readonly #asker: Asker;

  constructor(token: string | null, version: Version) {
    this.met = new WatchedValue(version);
    this.started = new StartedInstances(version.run, sessionStorage);
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
    // A restarted system does not know the session.
    this.stream.connection.watch(() => {
      if (this.stream.connection.get() === "open" && this.session.name.get() === null) void this.session.open();
    });
  }

  close(): void {
    this.stream.close();
    this.command.stop();
    this.alarms.stop();
  }

  /** Makes a read-only call. Throws `RefusalError`. */
  look<N extends keyof Looks>(name: N, args: Looks[N][0], signal?: AbortSignal): Promise<Looks[N][1]> {
    return this.#sure(() => call<Looks[N][1]>(this.#asker, name, args, signal));
  }

  /**
   * Returns the time at which the person gave the current command: the time of the event that is being handled, or else the current
   * time.
   */
  pressed(): PressTime {
    const event = window.event;
    return this.stream.daemon_ms(event?.isTrusted ? event.timeStamp : performance.now());
  }

  /**
   * Takes command, then makes a call that commands. The daemon refuses the call if it arrives more than half a second after `pressed`,
   * by default the time at which the call begins. Throws `RefusalError`.
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

  /** Makes a call that does not affect the machine: it neither needs command nor takes it. Throws `RefusalError`. */
  async aside<N extends keyof Asides>(name: N, args: Asides[N][0]): Promise<Asides[N][1]> {
    await this.session.open();
    return this.#sure(() => call<Asides[N][1]>(this.#asker, name, args));
  }

  /** Makes a call that stops something. It neither needs command nor takes it: the role `operate` suffices. Throws `RefusalError`. */
  stop<N extends keyof Stops>(name: N, args: Stops[N][0]): Promise<void> {
    return this.#sure(() => stop({ ...this.#asker, isFirst: true }, name, args));
  }

  /** Triggers the emergency stop immediately. Requires the role `operate`, but not command. */
  async emergencyStop(reason: string, signal?: AbortSignal): Promise<null> {
    try {
      return await call<null>({ ...this.#asker, isUrgent: true }, "emergency_stop", { reason }, signal);
    } catch (why) {
      // An emergency stop needs no session, so none is opened for it.
      if (!(why instanceof RefusalError && why.is("SessionLost"))) throw why;
      return await call<null>({ token: this.#asker.token, session: null, isUrgent: true }, "emergency_stop", { reason }, signal);
    }
  }

  get<T>(path: string): Promise<T> {
    return this.#sure(() => request<T>(this.#asker, "GET", path));
  }

  /** Determines which run of the system is answering. If the system has restarted, discards the state of the previous run. */
  async #meet(): Promise<void> {
    const version = await answer<Version>(this.#asker, "GET", "/v1/version");
    const isAnother = version.run !== this.version.run;
    this.met.set(version);
    if (!isAnother) return;
    this.topics.renew();
    this.values.forget();
    this.started.forget(version.run);
    this.restarts.set(this.restarts.get() + 1);
  }

  /** Makes a call. If the session was lost, opens a new session and retries once. */
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

/** Connects to the system with this token. Throws `RefusalError`, with status 401 if the token is not valid. */
export async function connect(token: string | null): Promise<Control> {
  const asker: Asker = { token, session: null };
  const version = await answer<Version>(asker, "GET", "/v1/version");
  return new Control(token, version);
}
