// SPDX-License-Identifier: Apache-2.0
import { type Refusal, refusalsOf } from "./refusals";
import type { Alarms } from "./shapes";
import { WatchedValue } from "./watched";

/** Polling interval for the alarms, ms. */
const LOOK_MS = 1000;

/** The alarms of the system, shared by all views and read once a second. */
export class Alarming {
  readonly latest = new WatchedValue<Alarms | null>(null);
  /** Reason why the alarms could not be read; empty if they could. */
  readonly trouble = new WatchedValue<Refusal[]>([]);
  readonly #ask: () => Promise<Alarms>;
  #said = "";
  #again: ReturnType<typeof setTimeout> | undefined;
  #over = false;

  constructor(ask: () => Promise<Alarms>) {
    this.#ask = ask;
  }

  /** Reads the alarms immediately. */
  async look(): Promise<void> {
    try {
      const found = await this.#ask();
      const said = JSON.stringify(found);
      if (said !== this.#said) this.latest.set(found);
      this.#said = said;
      this.trouble.set([]);
    } catch (why) {
      this.trouble.set(refusalsOf(why));
    }
  }

  follow(): void {
    this.#over = false;
    clearTimeout(this.#again);
    void this.look().then(() => {
      if (!this.#over) this.#again = setTimeout(() => this.follow(), LOOK_MS);
    });
  }

  stop(): void {
    this.#over = true;
    clearTimeout(this.#again);
  }
}
