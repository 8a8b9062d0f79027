// SPDX-License-Identifier: Apache-2.0
import { tr } from "../language/text";
import { RefusalError } from "./refusals";
import type { Reading } from "./shapes";
import type { Source, Topic, Values } from "./source";
import { WatchedValue } from "./watched";

/** Returns a topic that is frozen at its current value. */
function stillTopic<T>(of: Topic<T>): Topic<T> {
  const latest = new WatchedValue(of.get());
  return { latest, trouble: new WatchedValue(of.trouble.get()), watch: () => () => undefined, get: latest.get };
}

class StillValues implements Values {
  readonly #readings: ReadonlyMap<string, Reading>;

  constructor(readings: ReadonlyMap<string, Reading>) {
    this.#readings = readings;
  }

  watch(name: string, watcher: (reading: Reading | null, missing: { class: string; message: string }[] | null) => void): () => void {
    const reading = this.#readings.get(name) ?? null;
    const missing = { class: "Still", message: tr("control.nameWasNotDisplayedWhenThe", { name }) };
    watcher(reading, reading ? null : [missing]);
    return () => undefined;
  }

  latest(name: string): Reading | undefined {
    return this.#readings.get(name);
  }

  renew(): void {}
}

/**
 * Returns the running system in the state that it had when the page was paused. Stops are passed on; all other commands are refused,
 * because the page does not show the current state.
 */
export function stillOf(source: Source, readings: ReadonlyMap<string, Reading>): Source {
  const { topics } = source;
  return {
    version: source.version,
    role: "observe",
    restarts: source.restarts,
    stream: source.stream,
    topics: {
      statistics: stillTopic(topics.statistics),
      installed: stillTopic(topics.installed),
      log: stillTopic(topics.log),
      ends: stillTopic(topics.ends),
    },
    values: new StillValues(readings),
    alarms: { latest: new WatchedValue(source.alarms.latest.get()), trouble: new WatchedValue([]), look: async () => undefined },
    started: source.started,
    past: null,
    origin: source,
    may: (role) => role === "observe",
    look: (name, args, signal) => source.look(name, args, signal),
    pressed: () => null,
    order: () => Promise.reject(notNow(tr("control.thePageIsPaused"))),
    aside: () => Promise.reject(notNow(tr("control.thePageIsPaused"))),
    stop: (name, args) => source.stop(name, args),
  };
}

/** Returns the refusal of a command while the page shows the past. */
export function notNow(why: string): RefusalError {
  return new RefusalError(
    [{ class: "InvalidState", message: tr("control.whyCommandsAreNotPossible", { why }), remedy: tr("control.returnToLive") }],
    0,
  );
}
