// SPDX-License-Identifier: Apache-2.0

/** roll: no trigger; auto: shows the present where none comes; normal: shows the last one; single: stops after the next one. */
export type SweepMode = "roll" | "auto" | "normal" | "single";
export type SweepState = "rolling" | "waiting" | "collecting" | "stopped";

/** Span on the screen. `origin_ns`: where time 0 of the axis is. */
export interface Span {
  from_ns: number;
  to_ns: number;
  origin_ns: number;
  triggered: boolean;
}

/** After how long without a trigger `auto` shows the present, ns of the system's clock; at least one span. */
const AUTO_NS = 500e6;

/** Decides what is shown: from trigger to trigger, each with `pre_ns` before it and `span_ns` in all. */
export class Sweep {
  readonly mode: SweepMode;
  readonly span_ns: number;
  readonly pre_ns: number;
  /** Triggers that were shown. */
  triggers = 0;
  #state: SweepState;
  #trigger_ns: number | null = null;
  #not_before_ns = Number.NEGATIVE_INFINITY;
  #newest_ns: number | null = null;

  /** `before`: what it takes the place of; its last trigger stays on the screen. */
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

  /** True if nothing is kept because the one trigger of `single` is complete. */
  get stopped(): boolean {
    return this.#state === "stopped";
  }

  /** Waits for triggers behind `after_ns` only. */
  arm(after_ns: number): void {
    if (this.mode === "roll") return;
    this.#state = "waiting";
    this.#not_before_ns = after_ns;
  }

  /** Values up to `time_ns` are there. */
  reached(time_ns: number): void {
    this.#newest_ns = Math.max(time_ns, this.#newest_ns ?? time_ns);
    if (this.#state !== "collecting" || this.#newest_ns < this.#ending()) return;
    this.#state = this.mode === "single" ? "stopped" : "waiting";
    this.#not_before_ns = this.#ending();
  }

  /** The trigger's signal crossed its level, or its condition came. Answers whether it begins a sweep. */
  triggered(time_ns: number): boolean {
    if (this.#state !== "waiting" || time_ns < this.#not_before_ns) return false;
    this.#trigger_ns = time_ns;
    this.#state = "collecting";
    this.triggers += 1;
    if (this.#newest_ns !== null) this.reached(this.#newest_ns);
    return true;
  }

  /** Returns the span to show now; null while nothing came. */
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
