// SPDX-License-Identifier: Apache-2.0
// Moving a joint as long as a button is held.

import { RefusalError } from "../../control/refusals";
import type { Source } from "../../control/source";

/** The verb that moves as long as its heartbeat changes: `gpac.motion.jog`. */
export const JOG = "jog";
/** The SVV into which the page writes that its button is still held. */
export const BEAT = "studio.heartbeat";
/** Period, ms: the joints stop when the last one is older than 250 ms. */
const BEAT_MS = 60;

/** One press of a button, from its beginning to its end. */
export class Press {
  readonly #control: Source;
  #held = true;
  /** Over: the joint stands, and the instance is gone. */
  readonly done: Promise<void>;

  /** `before`: the press before it, whose halt it waits for. */
  constructor(control: Source, device: string, velocity: string, before: Promise<unknown> = Promise.resolve()) {
    this.#control = control;
    this.done = before.then(
      () => this.#move(device, velocity),
      () => this.#move(device, velocity),
    );
  }

  release(): void {
    this.#held = false;
  }

  async #move(device: string, velocity: string): Promise<void> {
    // Released before it could begin: nothing has moved.
    if (!this.#held) return;
    const control = this.#control;
    let beat = (Math.floor(Date.now() / BEAT_MS) % 1_000_000) + 1;
    const say = () => control.order("write", { name: BEAT, value: beat++ });
    await say();
    // A button that is held commands each call at the time of that call.
    const instance = await control.order("create", { verb: JOG, arguments: { arm: { devices: [device] }, heartbeat: { svv: BEAT } } });
    let isStarted = false;
    try {
      // The button was released meanwhile, or the connection was lost.
      if (!this.#held) return;
      isStarted = true;
      await control.order("start", { instance, values: { velocity } });
      while (this.#held && (await control.look("state", { instance })) === "running") {
        await say();
        await new Promise((again) => setTimeout(again, BEAT_MS));
      }
    } finally {
      if (isStarted) {
        // Whatever has happened: the joint is halted first, which needs no command, and the instance is gone then.
        await control.stop("halt", { instance }).catch(ended);
        await control.look("wait", { instance }).catch(ended);
      }
      await control.order("delete", { instance });
    }
  }
}

/** It had ended by itself: that is no fault. */
function ended(why: unknown): void {
  if (!(why instanceof RefusalError && why.is("InvalidState"))) throw why;
}
