// SPDX-License-Identifier: Apache-2.0
import { type Refusal, RefusalError, refusalsOf } from "./refusals";
import { type Asker, request } from "./requests";
import { WatchedValue } from "./watched";

const KEY = "opengpac.session";
/** Storage key for the name of the person at this browser. */
const PERSON = "opengpac.person";

interface OpenedSession {
  session: string;
  name: string;
  heartbeat_ms: number;
  returned: boolean;
}

/**
 * The session of this page, opened at startup, kept alive, and reopened if it is lost. The session owns the verb instances that it
 * starts.
 */
export class Session {
  /** Name of the session, as seen by others; null while there is no session. */
  readonly name = new WatchedValue<string | null>(null);
  /** Reason why there is no session; empty if there is one. */
  readonly trouble = new WatchedValue<Refusal[]>([]);
  /** Name of the person at this page, shown to others; empty if none was entered. */
  readonly person = new WatchedValue<string>(localStorage.getItem(PERSON) ?? "");
  readonly #asker: Asker;
  readonly #heartbeat: Worker;
  #opening: Promise<void> | null = null;

  constructor(asker: Asker) {
    this.#asker = asker;
    this.#heartbeat = new Worker(new URL("./heartbeat.ts", import.meta.url), { type: "module" });
    this.#heartbeat.onmessage = () => void this.renew();
  }

  /** Opens a session, unless one is open. Errors are stored in `trouble`. */
  open(): Promise<void> {
    this.#opening ??= this.#open().finally(() => {
      this.#opening = null;
    });
    return this.#opening;
  }

  /** Opens another session if the current one no longer exists in the system. */
  renew(): Promise<void> {
    this.#forget();
    return this.open();
  }

  /** Sets the name of the person at this page; the session continues under this name. Throws `RefusalError`. */
  async introduce(person: string): Promise<void> {
    const said = person.trim();
    if (said === "" || said === this.person.get()) return;
    const name = this.name.get();
    if (name !== null) this.#take(await request<OpenedSession>(this.#asker, "POST", "/v1/sessions", { name, take_up: true, person: said }));
    localStorage.setItem(PERSON, said);
    this.person.set(said);
  }

  /** Closes the session in an orderly way, so that the instances that it has started continue to run. */
  async close(): Promise<void> {
    if (this.#asker.session === null) return;
    await request(this.#asker, "DELETE", "/v1/sessions");
    this.#forget();
    sessionStorage.removeItem(KEY);
  }

  async #open(): Promise<void> {
    if (this.#asker.session !== null) return;
    try {
      this.#take(await this.#ask());
      this.trouble.set([]);
    } catch (why) {
      this.trouble.set(refusalsOf(why));
    }
  }

  #take(opened: OpenedSession): void {
    sessionStorage.setItem(KEY, opened.name);
    this.#asker.session = opened.session;
    this.#heartbeat.postMessage({ token: this.#asker.token, session: opened.session, every_ms: opened.heartbeat_ms });
    this.name.set(opened.name);
  }

  async #ask(): Promise<OpenedSession> {
    const person = this.person.get() === "" ? {} : { person: this.person.get() };
    const before = sessionStorage.getItem(KEY);
    try {
      // A reloaded page resumes its session: it keeps its command and the instances that it has started.
      return await request<OpenedSession>(this.#asker, "POST", "/v1/sessions", {
        ...(before ? { name: before, take_up: true } : { name: newName() }),
        ...person,
      });
    } catch (why) {
      if (before && why instanceof RefusalError && why.is("InUse")) {
        return await request<OpenedSession>(this.#asker, "POST", "/v1/sessions", { name: newName(), ...person });
      }
      throw why;
    }
  }

  #forget(): void {
    this.#asker.session = null;
    this.#heartbeat.postMessage(null);
    this.name.set(null);
  }
}

function newName(): string {
  const letters = crypto.getRandomValues(new Uint8Array(4));
  return `studio-${[...letters].map((letter) => (letter % 36).toString(36)).join("")}`;
}
