// SPDX-License-Identifier: Apache-2.0
// Replay of a recording by the system, in a separate process: its progress, and the first value that differs from the recorded one.
import { tr } from "../../language/text";
import { Attempts } from "../asking";
import type { Control } from "../control";
import { type Refusal, refusalsOf } from "../refusals";
import type { InstalledInstances, ReplayDifference, Replaying } from "../shapes";
import type { Differs } from "../source";
import { WatchedValue } from "../watched";

/** Polling interval for the progress, ms. */
const LOOK_MS = 200;

export type Replay =
  | { kind: "none" }
  | { kind: "runs"; firings: number; time_ns: number | null }
  | { kind: "over"; firings: number; message: string; differs: Differs | null; isWhole: boolean; time_ns: number }
  | { kind: "failed"; refusals: Refusal[] };

type ReplayCalls = Pick<Control, "look" | "aside">;

/** The replay of one recording. */
export class ReplayRun {
  readonly state = new WatchedValue<Replay>({ kind: "none" });
  /**
   * First difference found by the latest complete replay; null if every value was equal to the recorded one, or if no replay has
   * finished.
   */
  readonly differs = new WatchedValue<Differs | null>(null);
  readonly #system: ReplayCalls;
  readonly #name: string;
  readonly #installed: () => readonly InstalledInstances[];
  #number: number | null = null;

  /** `installed` returns the instances in the recording, with their blocks and cells. */
  constructor(system: ReplayCalls, name: string, installed: () => readonly InstalledInstances[]) {
    this.#system = system;
    this.#name = name;
    this.#installed = installed;
  }

  /** Replays the recording; if `present`, with the system's current code modules. Resolves when the replay has finished. */
  async run(present: boolean): Promise<void> {
    if (this.state.get().kind === "runs") return;
    this.differs.set(null);
    this.state.set({ kind: "runs", firings: 0, time_ns: null });
    let replay: number | null = null;
    try {
      ({ replay } = await this.#system.aside("replay", { path: this.#name, present }));
      this.#number = replay;
      const over = await this.#end(replay);
      if (over) this.#over(over);
    } catch (why) {
      // The system no longer knows a cancelled replay.
      if (replay === null || this.#number === replay) this.state.set({ kind: "failed", refusals: refusalsOf(why) });
    }
    if (replay === null || this.#number !== replay) return;
    this.#number = null;
    // Deletes the replay on the system; fails harmlessly if it was already deleted.
    await this.#system.aside("stop_replay", { replay }).catch(() => undefined);
  }

  /** Waits until the replay ends, and returns its final state; null if it was cancelled. */
  async #end(replay: number): Promise<Replaying | null> {
    let attempts = new Attempts();
    for (;;) {
      const now = await this.#system.look("replaying", { replay }).catch((why) => attempts.againAfter_ms(why) ?? Promise.reject(why));
      if (this.#number !== replay) return null;
      if (typeof now === "number") {
        // The replay continues, although the system did not answer.
        await new Promise((again) => setTimeout(again, now));
        continue;
      }
      attempts = new Attempts();
      if (!now.running) return now;
      this.state.set({ kind: "runs", firings: now.firings, time_ns: now.time_ns });
      await new Promise((again) => setTimeout(again, LOOK_MS));
    }
  }

  /** Cancels the replay. Throws `RefusalError`. */
  async cancel(): Promise<void> {
    const replay = this.#number;
    if (replay === null) return;
    this.#number = null;
    await this.#system.aside("stop_replay", { replay });
    this.state.set({ kind: "none" });
  }

  #over({ found, failure }: Replaying): void {
    if (!found) {
      this.state.set({ kind: "failed", refusals: [{ class: "Replay", message: failure ?? tr("control.theReplayHasNoResult") }] });
      return;
    }
    const { firings, message, difference, stopped, time_ns } = found;
    const differs = difference && differsOf(difference, this.#installed());
    this.differs.set(differs);
    this.state.set({ kind: "over", firings, message, differs, isWhole: stopped === "end", time_ns });
  }
}

/** Converts a difference to the format that the page shows. The installed instances supply the names of private cells. */
export function differsOf(found: ReplayDifference, installed: readonly InstalledInstances[]): Differs {
  const when = tr("control.firingNumberOfSourceSource", {
    part: found.between ? tr("control.after") : tr("control.in"),
    number: found.number,
    source: found.source,
  });
  const which = found.block === "" ? "" : `${tr("control.blockBlockOutputPort", { block: found.block, port: found.port })} `;
  return {
    time_ns: found.time_ns,
    where: `${which}${when}${found.how && `: ${found.how}`}`,
    signal: found.svv || cellOf(found, installed),
    recorded: text(found.recorded),
    replayed: text(found.replayed),
  };
}

/** Returns the cell that stores the port of a block `INSTANCE.LABEL`. */
function cellOf({ block, port }: ReplayDifference, installed: readonly InstalledInstances[]): string | null {
  for (const instance of installed.flatMap((one) => one.instances)) {
    if (!block.startsWith(`${instance.name}.`)) continue;
    const found = instance.blocks.find((one) => block === `${instance.name}.${one.label}`)?.ports.find((one) => one.name === port);
    if (found?.cell) return found.cell;
  }
  return null;
}

/** Formats numbers without superfluous zeros: "42", not "42.0". */
function text(elements: readonly string[]): string {
  const said = elements.map((one) => one.replace(/\.0$/, ""));
  return said.length === 1 ? (said[0] ?? "") : said.length === 0 ? "–" : `(${said.join(", ")})`;
}
