// SPDX-License-Identifier: Apache-2.0

/**
 * `roll`: no trigger. `auto`: shows the latest values if no trigger occurs. `normal`: shows the latest trigger. `single`: stops after
 * the next trigger.
 */
export type SweepMode = "roll" | "auto" | "normal" | "single";
export type SweepState = "rolling" | "waiting" | "collecting" | "stopped";

/** Span on the screen; `origin_ns` is time 0 of the axis. */
export interface Span {
  from_ns: number;
  to_ns: number;
  origin_ns: number;
  triggered: boolean;
}

/**
 * Time without a trigger after which `auto` shows the latest values, ns on the system's clock. If the span on the screen is longer, the
 * span is used instead.
 */
const AUTO_NS = 500e6;

/** Decides which span is shown: one span for each trigger, which begins `pre_ns` before the trigger and has the length `span_ns`. */
export class Sweep {
  readonly mode: SweepMode;
  readonly span_ns: number;
  readonly pre_ns: number;
  /** Number of triggers shown. */
  triggers = 0;
  #state: SweepState;
  #trigger_ns: number | null = null;
  #not_before_ns = Number.NEGATIVE_INFINITY;
  #newest_ns: number | null = null;

  /** `before` is the sweep that this one replaces; its latest trigger stays on the screen. */
  constructor(mode: SweepMode, span_ns: number, pre_ns: number, before?: Sweep) {
    this.mode = mode;
    this.span_ns = span_ns;
    this.pre_ns = Math.min(Math.max(0, pre_ns), span_ns);
    this.#state = mode === "roll" ? "rolling" : "waiting";
    if (before && mode !== "roll") this.#trigger_ns = before.#trigger_ns;
  }

  get state(): SweepState {
    return this.#state;
  }

  /** True if no more values are stored because the single trigger of `single` is complete. */
  get stopped(): boolean {
    return this.#state === "stopped";
  }

  /** Waits for a trigger after `after_ns`. */
  arm(after_ns: number): void {
    if (this.mode === "roll") return;
    this.#state = "waiting";
    this.#not_before_ns = after_ns;
  }

  /** Notifies the sweep that values up to `time_ns` have arrived. */
  reached(time_ns: number): void {
    this.#newest_ns = Math.max(time_ns, this.#newest_ns ?? time_ns);
    if (this.#state !== "collecting" || this.#newest_ns < this.#ending()) return;
    this.#state = this.mode === "single" ? "stopped" : "waiting";
    this.#not_before_ns = this.#ending();
  }

  /** Reports that the signal crossed the level, or that the event occurred. Returns whether this starts a sweep. */
  triggered(time_ns: number): boolean {
    if (this.#state !== "waiting" || time_ns < this.#not_before_ns) return false;
    this.#trigger_ns = time_ns;
    this.#state = "collecting";
    this.triggers += 1;
    if (this.#newest_ns !== null) this.reached(this.#newest_ns);
    return true;
  }

  /** Returns the span to show now; null before the first value. */
  span(): Span | null {
    const newest = this.#newest_ns;
    const trigger = this.#trigger_ns;
    if (newest === null) return null;
    const old = trigger !== null && this.mode === "auto" && newest - this.#ending() > Math.max(AUTO_NS, this.span_ns);
    if (trigger === null || old) {
      return { from_ns: newest - this.span_ns, to_ns: newest, origin_ns: newest, triggered: false };
    }
    const from_ns = trigger - this.pre_ns;
    return { from_ns, to_ns: from_ns + this.span_ns, origin_ns: trigger, triggered: true };
  }

  #ending(): number {
    return (this.#trigger_ns ?? 0) - this.pre_ns + this.span_ns;
  }
}
