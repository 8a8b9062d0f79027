// SPDX-License-Identifier: Apache-2.0
import { RefusalError } from "./refusals";
import { type Asker, request } from "./requests";
import type { Holder, Role } from "./shapes";
import { WatchedValue } from "./watched";

/** Polling interval for the holder of command, ms. */
const LOOK_MS = 1000;

/** State in which no session has command or requests it. */
const NOBODY: Holder = { holder: null, who: null, person: null, requests: [], settled: [] };

/**
 * Command of the system, which one session has at a time. The page takes it only when a person gives a command. If another session has
 * it, the page requests it, and that session hands it over or declines.
 */
export class Command {
  /** Holder of command, pending requests, and the outcomes of the latest requests. */
  readonly state = new WatchedValue<Holder>(NOBODY);
  /** Name of the session that has command; null if no session has it. */
  readonly holder = new WatchedValue<string | null>(null);
  readonly #asker: Asker;
  readonly #name: () => string | null;
  #looking: ReturnType<typeof setTimeout> | undefined;
  #said = "";

  constructor(asker: Asker, name: () => string | null) {
    this.#asker = asker;
    this.#name = name;
  }

  get ours(): boolean {
    const name = this.#name();
    return name !== null && this.holder.get() === name;
  }

  /** Takes command; `force` takes it even from its holder (role `configure`). Throws a `RefusalError` that names the holder. */
  take(force = false): Promise<void> {
    return this.#ask("POST", "/v1/command", force ? { force: true } : {});
  }

  giveBack(): Promise<void> {
    return this.#ask("DELETE", "/v1/command");
  }

  /** Requests command from its holder; it is granted immediately if there is no holder. */
  request(reason: string): Promise<void> {
    return this.#ask("POST", "/v1/command/request", { reason });
  }

  /** Withdraws the request. */
  withdraw(): Promise<void> {
    return this.#ask("DELETE", "/v1/command/request", {});
  }

  handOver(to: string): Promise<void> {
    return this.#ask("POST", "/v1/command/hand_over", { to });
  }

  decline(name: string, reason: string): Promise<void> {
    return this.#ask("POST", "/v1/command/decline", { name, reason });
  }

  /** Executes an order while holding command. If command was lost in the meantime, takes it again and retries once. */
  async with<T>(order: () => Promise<T>): Promise<T> {
    if (!this.ours) await this.take();
    try {
      return await order();
    } catch (why) {
      if (!(why instanceof RefusalError && why.is("NotCommanding"))) throw why;
      await this.look();
      await this.take();
      return await order();
    }
  }

  look(): Promise<void> {
    return this.#ask("GET", "/v1/command", undefined, AbortSignal.timeout(2 * LOOK_MS));
  }

  /** Polls the holder of command once a second. */
  follow(): void {
    clearTimeout(this.#looking);
    const again = () => {
      this.#looking = setTimeout(() => this.follow(), LOOK_MS);
    };
    // The stream reports a system that does not answer.
    this.look().then(again, again);
  }

  stop(): void {
    clearTimeout(this.#looking);
  }

  async #ask(method: string, path: string, body?: object, signal?: AbortSignal): Promise<void> {
    const told = (await request<Holder | null>(this.#asker, method, path, body, signal)) ?? NOBODY;
    const said = JSON.stringify(told);
    if (said !== this.#said) this.state.set(told);
    this.#said = said;
    this.holder.set(told.holder);
  }
}

/** Returns the name of the person behind a session, or, if unknown, the name of the caller. */
export function personOf(of: { who?: string | null; person?: string | null }): string {
  return of.person ?? of.who ?? "";
}

const RANKS: Role[] = ["observe", "operate", "configure", "download"];

/** Returns whether the role `has` includes the permissions of the role `needs`. */
export function may(has: Role, needs: Role): boolean {
  return RANKS.indexOf(has) >= RANKS.indexOf(needs);
}
