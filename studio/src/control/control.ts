// SPDX-License-Identifier: Apache-2.0
import { LiveValues } from "../live/values";
import { call, type Looks, type Orders } from "./calls";
import { Command, may } from "./command";
import { Refused } from "./refusals";
import { type Asker, answer, request } from "./requests";
import { Session } from "./session";
import type { Role, Version } from "./shapes";
import { Started } from "./started";
import { Stream } from "./stream";
import { Topics } from "./topics";

/** The real-time system, as the page sees it: looking, commanding, and what comes by itself. */
export class Control {
  readonly version: Version;
  readonly session: Session;
  readonly command: Command;
  readonly stream: Stream;
  readonly topics: Topics;
  readonly values: LiveValues;
  readonly started = new Started();
  readonly #asker: Asker;

  constructor(token: string | null, version: Version) {
    this.version = version;
    this.#asker = { token, session: null };
    this.session = new Session(this.#asker);
    this.command = new Command(this.#asker, this.session.name.get);
    this.stream = new Stream(() => ({ url: `${window.location.origin.replace(/^http/, "ws")}/v1/stream`, token }));
    this.topics = new Topics(this.stream);
    this.values = new LiveValues(this.stream);
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
    // Where the system was started again, it knows nothing of the session.
    this.stream.connection.watch(() => {
      if (this.stream.connection.get() === "open" && this.session.name.get() === null) void this.session.open();
    });
  }

  close(): void {
    this.stream.close();
    this.command.stop();
  }

  /** Makes a call that only looks. Errors: `Refused`. */
  look<N extends keyof Looks>(name: N, args: Looks[N][0], signal?: AbortSignal): Promise<Looks[N][1]> {
    return this.#sure(() => call<Looks[N][1]>(this.#asker, name, args, signal));
  }

  /** Makes a call that commands; takes command first. Errors: `Refused`. */
  async order<N extends keyof Orders>(name: N, args: Orders[N][0], signal?: AbortSignal): Promise<Orders[N][1]> {
    await this.session.open();
    const done = await this.#sure(() => this.command.with(() => call<Orders[N][1]>(this.#asker, name, args, signal)));
    if (name === "start") this.started.add((args as Orders["start"][0]).instance);
    return done;
  }

  /** Stops everything at once: needs the role `operate`, and no command. */
  emergencyStop(reason: string): Promise<null> {
    return this.#sure(() => call<null>(this.#asker, "emergency_stop", { reason }));
  }

  get<T>(path: string): Promise<T> {
    return this.#sure(() => request<T>(this.#asker, "GET", path));
  }

  /** A session that was lost is opened again, once. */
  async #sure<T>(asked: () => Promise<T>): Promise<T> {
    try {
      return await asked();
    } catch (why) {
      if (!(why instanceof Refused && why.is("SessionLost"))) throw why;
      await this.session.renew();
      return await asked();
    }
  }
}

/** Asks who is there, with this token. Errors: `Refused`; 401 where the token is not known. */
export async function connect(token: string | null): Promise<Control> {
  const asker: Asker = { token, session: null };
  const version = await answer<Version>(asker, "GET", "/v1/version");
  return new Control(token, version);
}
