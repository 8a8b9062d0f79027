// SPDX-License-Identifier: Apache-2.0
// A recording that the system runs again, beside itself: how far it has come, and the first value that is not as it was recorded.
import type { Control } from "../control";
import { type Refusal, refusalsOf } from "../refusals";
import type { InstalledInstances, ReplayDifference, Replaying } from "../shapes";
import type { Differs } from "../source";
import { WatchedValue } from "../watched";

/** Period at which progress is read, ms. */
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
  /** Of the last replay that came to its end; null: every value was as recorded, or none is over. */
  readonly differs = new WatchedValue<Differs | null>(null);
  readonly #system: ReplayCalls;
  readonly #name: string;
  readonly #installed: () => readonly InstalledInstances[];
  #number: number | null = null;

  /** `installed`: what the recording tells of instances, their blocks and cells. */
  constructor(system: ReplayCalls, name: string, installed: () => readonly InstalledInstances[]) {
    this.#system = system;
    this.#name = name;
    this.#installed = installed;
  }

  /** Runs it again; `present`: with the code modules that the system has now. Resolves when it is over. */
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
      // What was cancelled is known to the system no more.
      if (replay === null || this.#number === replay) this.state.set({ kind: "failed", refusals: refusalsOf(why) });
    }
    if (replay === null || this.#number !== replay) return;
    this.#number = null;
    // The system forgets it; one that was closed has.
    await this.#system.aside("stop_replay", { replay }).catch(() => undefined);
  }

  /** Returns its state at its end; null: it was cancelled. */
  async #end(replay: number): Promise<Replaying | null> {
    for (;;) {
      const now = await this.#system.look("replaying", { replay });
      if (this.#number !== replay) return null;
      if (!now.running) return now;
      this.state.set({ kind: "runs", firings: now.firings, time_ns: now.time_ns });
      await new Promise((again) => setTimeout(again, LOOK_MS));
    }
  }

  /** Ends it where it is. Errors: `RefusalError`. */
  async cancel(): Promise<void> {
    const replay = this.#number;
    if (replay === null) return;
    this.#number = null;
    await this.#system.aside("stop_replay", { replay });
    this.state.set({ kind: "none" });
  }

  #over({ found, failure }: Replaying): void {
    if (!found) {
      this.state.set({ kind: "failed", refusals: [{ class: "Replay", message: failure ?? "nothing was found" }] });
      return;
    }
    const { firings, message, difference, stopped, time_ns } = found;
    const differs = difference && differsOf(difference, this.#installed());
    this.differs.set(differs);
    this.state.set({ kind: "over", firings, message, differs, isWhole: stopped === "end", time_ns });
  }
}

/** A difference as the page tells it: private cells are found by what was installed. */
export function differsOf(found: ReplayDifference, installed: readonly InstalledInstances[]): Differs {
  const when = `${found.between ? "after" : "in"} firing ${found.number} of source '${found.source}'`;
  const which = found.block === "" ? "" : `block '${found.block}', output '${found.port}', `;
  return {
    time_ns: found.time_ns,
    where: `${which}${when}${found.how && `: ${found.how}`}`,
    signal: found.svv || cellOf(found, installed),
    recorded: text(found.recorded),
    replayed: text(found.replayed),
  };
}

/** Where the port of a block, `INSTANCE.LABEL`, is stored. */
function cellOf({ block, port }: ReplayDifference, installed: readonly InstalledInstances[]): string | null {
  for (const instance of installed.flatMap((one) => one.instances)) {
    if (!block.startsWith(`${instance.name}.`)) continue;
    const found = instance.blocks.find((one) => block === `${instance.name}.${one.label}`)?.ports.find((one) => one.name === port);
    if (found?.cell) return found.cell;
  }
  return null;
}

/** A number with as many digits as it needs: "42", not "42.0". */
function text(elements: readonly string[]): string {
  const said = elements.map((one) => one.replace(/\.0$/, ""));
  return said.length === 1 ? (said[0] ?? "") : said.length === 0 ? "–" : `(${said.join(", ")})`;
}
