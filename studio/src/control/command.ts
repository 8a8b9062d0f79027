// SPDX-License-Identifier: Apache-2.0
import { Refused } from "./refusals";
import { type Asker, request } from "./requests";
import type { Role } from "./shapes";
import { Watched } from "./watched";

/** How often it is looked who commands, ms. */
const LOOK_MS = 1000;

/** Who commands the system: one session at a time. The page takes command when a person presses a command, and not before. */
export class Command {
  /** The name of the session that commands; null: nobody. */
  readonly holder = new Watched<string | null>(null);
  readonly #asker: Asker;
  readonly #name: () => string | null;
  #looking: ReturnType<typeof setTimeout> | undefined;

  constructor(asker: Asker, name: () => string | null) {
    this.#asker = asker;
    this.#name = name;
  }

  get ours(): boolean {
    const name = this.#name();
    return name !== null && this.holder.get() === name;
  }

  /** Takes command. `force`: from its holder (role `configure`). Errors: `Refused`, naming the holder. */
  async take(force = false): Promise<void> {
    const { holder } = await request<{ holder: string }>(this.#asker, "POST", "/v1/command", force ? { force: true } : {});
    this.holder.set(holder);
  }

  async giveBack(): Promise<void> {
    await request(this.#asker, "DELETE", "/v1/command");
    await this.look();
  }

  /** Makes an order, with command. Where it was lost meanwhile, it is asked for once more. */
  async with<T>(order: () => Promise<T>): Promise<T> {
    if (!this.ours) await this.take();
    try {
      return await order();
    } catch (why) {
      if (!(why instanceof Refused && why.is("NotCommanding"))) throw why;
      await this.look();
      await this.take();
      return await order();
    }
  }

  async look(): Promise<void> {
    const answered = await request<{ holder: string | null } | null>(this.#asker, "GET", "/v1/command");
    this.holder.set(answered?.holder ?? null);
  }

  /** Looks once a second who commands. */
  follow(): void {
    clearTimeout(this.#looking);
    const again = () => {
      this.#looking = setTimeout(() => this.follow(), LOOK_MS);
    };
    // A system that does not answer is told of by the stream.
    this.look().then(again, again);
  }

  stop(): void {
    clearTimeout(this.#looking);
  }
}

const RANKS: Role[] = ["observe", "operate", "configure", "download"];

/** Whether somebody with role `has` may do what `needs` at the least. */
export function may(has: Role, needs: Role): boolean {
  return RANKS.indexOf(has) >= RANKS.indexOf(needs);
}
