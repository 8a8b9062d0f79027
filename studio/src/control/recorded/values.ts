// SPDX-License-Identifier: Apache-2.0
import { tr } from "../../language/text";
import type { Refusal } from "../refusals";
import type { Reading } from "../shapes";
import type { Values, Watcher } from "../source";

/** The values of a recording at its cursor, which can be watched like those of the running system. */
export class RecordedValues implements Values {
  readonly #known: (name: string) => boolean;
  /** Called when a name gets its first watcher. */
  readonly #wanted: () => void;
  readonly #cells = new Map<string, { watchers: Set<Watcher>; reading: Reading | null | undefined }>();

  constructor(known: (name: string) => boolean, wanted: () => void) {
    this.#known = known;
    this.#wanted = wanted;
  }

  watch(name: string, watcher: Watcher): () => void {
    if (!this.#known(name)) {
      watcher(null, notRecorded(name));
      return () => undefined;
    }
    let cell = this.#cells.get(name);
    if (!cell) {
      cell = { watchers: new Set(), reading: undefined };
      this.#cells.set(name, cell);
      this.#wanted();
    } else if (cell.reading !== undefined) {
      watcher(cell.reading, null);
    }
    const watched = cell;
    watched.watchers.add(watcher);
    return () => {
      watched.watchers.delete(watcher);
      if (watched.watchers.size === 0 && this.#cells.get(name) === watched) this.#cells.delete(name);
    };
  }

  latest(name: string): Reading | undefined {
    return this.#cells.get(name)?.reading ?? undefined;
  }

  renew(): void {}

  /** Returns the watched names. */
  names(): string[] {
    return [...this.#cells.keys()];
  }

  /** Passes the most recent values before the cursor to their watchers. */
  take(values: Readonly<Record<string, Reading | null>>): void {
    for (const [name, cell] of this.#cells) {
      const reading = values[name];
      if (reading === undefined) continue;
      const before = cell.reading;
      cell.reading = reading;
      if (before !== undefined && before?.number === reading?.number && before?.time_ns === reading?.time_ns) continue;
      for (const watcher of cell.watchers) watcher(reading, null);
    }
  }
}

export function notRecorded(name: string): Refusal[] {
  return [{ class: "NotRecorded", message: tr("control.nameIsNotInTheRecording", { name }) }];
}
