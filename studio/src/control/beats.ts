// SPDX-License-Identifier: Apache-2.0

/** Maximum clock drift between a browser and a daemon, ms per ms. */
const DRIFT = 0.0002;

/**
 * Estimate of the daemon's clock from its heartbeats. Beats arrive with a delay, so the estimate is never ahead of the daemon: a command
 * may appear older than it is, never younger. All local times are those of `performance.now()`.
 */
export class Beats {
  /** Lead of the daemon's clock over the local one, ms, according to the beat with the smallest delay; null before the first beat. */
  #ahead: number | null = null;
  /** Local time of the last update of `#ahead`. */
  #at = 0;
  /** Local time at which the latest beat was sent. */
  #sent = performance.now();

  /**
   * Discards the estimate of the clock on a new connection, because the system may have restarted. The age of the last known state is
   * not reset.
   */
  forget(): void {
    this.#ahead = null;
  }

  hear(beat_ms: number, local_ms: number): void {
    const drifted = this.#ahead === null ? Number.NEGATIVE_INFINITY : this.#ahead - DRIFT * (local_ms - this.#at);
    this.#ahead = Math.max(drifted, beat_ms - local_ms);
    this.#at = local_ms;
    this.#sent = Math.max(this.#sent, beat_ms - this.#ahead);
  }

  /**
   * Returns the age of the last known state of the system, ms. If the latest beat was delayed, the age is counted from the time at which
   * it was sent.
   */
  age_ms(local_ms: number): number {
    return Math.max(0, local_ms - this.#sent);
  }

  /** Converts a local time to the daemon's time, in whole ms; null before the first beat. */
  daemon_ms(local_ms: number): number | null {
    return this.#ahead === null ? null : Math.floor(local_ms + this.#ahead - DRIFT * Math.max(0, local_ms - this.#at));
  }
}
