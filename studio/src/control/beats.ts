// SPDX-License-Identifier: Apache-2.0

/** The drift between the clocks of a browser and a daemon at the most, ms in each ms. */
const DRIFT = 0.0002;

/**
 * The daemon's clock, as its heartbeats tell it. A beat takes its time on the way, so the estimate is never ahead of the daemon: a
 * command looks older than it is, never younger. All local times are those of `performance.now()`.
 */
export class Beats {
  /** Lead of the daemon's clock over the local one, ms, by the quickest beat; null: none came. */
  #ahead: number | null = null;
  /** The local time for which that holds. */
  #at = 0;
  /** The local time at which the last beat was sent. */
  #sent = performance.now();

  /** Forgets the clock: another connection begins, which may lead to another run. What is known stays as old as it is. */
  forget(): void {
    this.#ahead = null;
  }

  hear(beat_ms: number, local_ms: number): void {
    const drifted = this.#ahead === null ? Number.NEGATIVE_INFINITY : this.#ahead - DRIFT * (local_ms - this.#at);
    this.#ahead = Math.max(drifted, beat_ms - local_ms);
    this.#at = local_ms;
    this.#sent = Math.max(this.#sent, beat_ms - this.#ahead);
  }

  /** Returns the age of the newest state that is known of the system, ms. Beats that come late make nothing new. */
  age_ms(local_ms: number): number {
    return Math.max(0, local_ms - this.#sent);
  }

  /** The daemon's time at a local time, in whole ms; null: no beat came yet. */
  daemon_ms(local_ms: number): number | null {
    return this.#ahead === null ? null : Math.floor(local_ms + this.#ahead - DRIFT * Math.max(0, local_ms - this.#at));
  }
}
