// SPDX-License-Identifier: Apache-2.0
// Moves something while a button is held, or by one step.

import { isLate } from "../../control/late";
import { RefusalError } from "../../control/refusals";
import type { Report, Value } from "../../control/shapes";
import type { PressTime, Source } from "../../control/source";

/** Verb that moves joints as long as its heartbeat changes: `gpac.motion.jog`. */
export const JOG = "jog";
/** Verb that moves the tool of an arm in the same way: `gpac.motion.jog_linear`. */
export const JOG_TOOL = "jog_linear";
/** SVV to which the page writes its heartbeat while the button is held. */
export const BEAT = "studio.heartbeat";
/** Period of the heartbeat, ms. The joints stop if the latest heartbeat is older than 250 ms. */
const BEAT_MS = 60;
/** Number of heartbeats after which a client's numbers repeat: `BEATS` of the block `heartbeat`. */
const BEATS = 2 ** 20;
/** Maximum client number. */
const CLIENT_MAX = 2 ** 31 - 1;

/** Returns a new client number. Each press has its own, so that no other press, of this or another page, keeps its motion going. */
function newClient(): number {
  const [random = 0] = crypto.getRandomValues(new Uint32Array(1));
  return 1 + (random % CLIENT_MAX);
}

/** Instances whose start was refused because it was late, by verb and devices. The next press starts them immediately. */
const KEPT = new WeakMap<Source, Map<string, number>>();

/** Motion started by one press. */
export interface JogMotion {
  verb: string;
  /** Logical devices of the verb's argument `arm`. */
  devices: string[];
  values: Record<string, Value>;
  /** True for a motion that ends by itself, so that the button need not be held. */
  isStep?: boolean;
}

/** One press of a button, from its beginning to its end. */
export class Press {
  readonly #control: Source;
  #held = true;
  /** For a step, the time of the press. The step must start within 0.5 s of it, because the button may be released by then. */
  readonly #pressed: PressTime | undefined;
  readonly motion: JogMotion;
  /**
   * Resolves when the joints are at rest and the instance has been deleted: with the report of a motion that ended by itself, otherwise
   * with null.
   */
  readonly done: Promise<Report | null>;

  /** `before` is the `done` of the previous press; this press waits until its motion has halted. */
  constructor(control: Source, motion: JogMotion, before: Promise<unknown> = Promise.resolve()) {
    this.#control = control;
    this.motion = motion;
    this.#pressed = motion.isStep ? control.pressed() : undefined;
    this.done = before.then(
      () => this.#move(),
      () => this.#move(),
    );
  }

  /** Handles the release of the button: a held motion ends, a step continues. */
  release(): void {
    if (!this.motion.isStep) this.#held = false;
  }

  /** Ends any motion, including a step, because the page is hidden or left, or its connection was lost. */
  leave(): void {
    this.#held = false;
  }

  async #move(): Promise<Report | null> {
    // Released before it could begin: nothing has moved.
    if (!this.#held) return null;
    const control = this.#control;
    const { verb, devices, values } = this.motion;
    const client = newClient();
    let beat = 0;
    const say = () => control.order("write", { name: BEAT, value: client * BEATS + (beat++ % BEATS) });
    const [form] = await Promise.all([control.look("verb_form", { name: verb }), say()]);
    // A program may have defined a verb of this name that knows no clients.
    const inputs = form.inputs.some((input) => input.name === "client") ? { ...values, client } : values;
    // A held button commands each call at the time of that call.
    const kept = KEPT.get(control) ?? new Map<string, number>();
    KEPT.set(control, kept);
    const key = [verb, ...devices].join(" ");
    const instance = kept.get(key) ?? (await control.order("create", { verb, arguments: { arm: { devices }, heartbeat: { svv: BEAT } } }));
    kept.delete(key);
    let isStarted = false;
    let report: Report | null = null;
    try {
      // The button was released meanwhile, or the connection was lost.
      if (!this.#held) return null;
      isStarted = true;
      await control.order("start", { instance, values: inputs }, undefined, this.#pressed).catch((why) => {
        if (this.#pressed !== undefined && isLate(control, this.#pressed)) kept.set(key, instance);
        throw why;
      });
      while (this.#held) {
        const [state] = await Promise.all([control.look("state", { instance }), say(), passed(BEAT_MS)]);
        if (state !== "running") break;
      }
      if (this.#held) report = await control.look("report", { instance });
    } finally {
      const isKept = kept.get(key) === instance;
      if (!isKept && isStarted && report === null) {
        // In any case, the joint is halted first, which needs no command; then the instance is deleted.
        await control.stop("halt", { instance }).catch(ended);
        await control.look("wait", { instance }).catch(ended);
      }
      if (!isKept) await connected(control).then(() => control.order("delete", { instance }));
    }
    return report;
  }
}

/** Waits until the page may command again, so that a connection that was just restored leaves no instance behind. */
async function connected(control: Source): Promise<void> {
  while (control.pressed() === null) await passed(BEAT_MS);
}

function passed(ms: number): Promise<void> {
  return new Promise((over) => setTimeout(over, ms));
}

/** Ignores an error that states that the instance has already ended. */
function ended(why: unknown): void {
  if (!(why instanceof RefusalError && why.is("InvalidState"))) throw why;
}
