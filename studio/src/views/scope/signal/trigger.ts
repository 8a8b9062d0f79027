// SPDX-License-Identifier: Apache-2.0

export type Edge = "rising" | "falling" | "either";

/** Finds where a signal crosses a level. It never crosses a gap: what happened there is not known. */
export class EdgeFinder {
  readonly edge: Edge;
  readonly level: number;
  /** Distance that it must go back before it can cross again. */
  readonly hysteresis: number;
  // At #up and more a signal that was below is above; below #down one that was above is below.
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

  /** Values are missing here. */
  gap(): void {
    this.#above = null;
  }

  /** The next value; the time at which the signal crossed the level (between this value and the one before), or null. */
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
