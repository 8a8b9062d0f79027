// SPDX-License-Identifier: Apache-2.0

export type Edge = "rising" | "falling" | "either";

/** Finds where a signal crosses a level. A gap is never a crossing, because the signal there is unknown. */
export class EdgeFinder {
  readonly edge: Edge;
  readonly level: number;
  /** Distance that the signal must move back before it can cross the level again. */
  readonly hysteresis: number;
  // A signal below the level becomes above at `#up`; one above becomes below when it is less than `#down`.
  readonly #up: number;
  readonly #down: number;
  #above: boolean | null = null;
  #time_ns = 0;
  #value = 0;

  constructor(edge: Edge, level: number, hysteresis = 0) {
    this.edge = edge;
    this.level = level;
    this.hysteresis = Math.max(0, hysteresis);
    this.#up = edge === "rising" ? level : edge === "falling" ? level + this.hysteresis : level + this.hysteresis / 2;
    this.#down = edge === "falling" ? level : edge === "rising" ? level - this.hysteresis : level - this.hysteresis / 2;
  }

  /** Marks a gap before the next value. */
  gap(): void {
    this.#above = null;
  }

  /**
   * Processes the next value. Returns the time at which the signal crossed the level, between the previous value and this one, or null.
   */
  next(time_ns: number, value: number): number | null {
    if (!Number.isFinite(value)) {
      this.gap();
      return null;
    }
    const before = this.#above;
    const above = value >= (before === null ? this.level : before ? this.#down : this.#up);
    const crossed = before !== null && above !== before && this.#wanted(above) ? this.#crossing(time_ns, value) : null;
    this.#above = above;
    this.#time_ns = time_ns;
    this.#value = value;
    return crossed;
  }

  #wanted(above: boolean): boolean {
    return this.edge === "either" || (this.edge === "rising") === above;
  }

  #crossing(time_ns: number, value: number): number {
    const rise = value - this.#value;
    if (rise === 0) return time_ns;
    const part = Math.min(1, Math.max(0, (this.level - this.#value) / rise));
    return this.#time_ns + part * (time_ns - this.#time_ns);
  }
}
