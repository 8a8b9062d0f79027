// SPDX-License-Identifier: Apache-2.0
import type { Refusal } from "../control/refusals";
import type { Reading } from "../control/shapes";
import type { Values, Watcher } from "../control/source";
import type { Stream } from "../control/stream";

/** First the update interval of values that a person reads, and then that of values that show a motion, ms. */
export const READ_MS = 100;
export const MOVE_MS = 33;

/**
 * The current values of SVVs and private cells, outside React, so that a changed value costs one write to one element.
 *
 * All values watched at one rate share one subscription of the stream. Names that do not exist in the system are left out of it and
 * reported to their watchers.
 */
export class LiveValues implements Values {
  readonly #read: Group;
  readonly #move: Group;

  constructor(stream: Stream) {
    this.#read = new Group(stream, READ_MS);
    this.#move = new Group(stream, MOVE_MS);
  }

  /** Watches a value until the returned function is called. `every_ms` is `READ_MS` or `MOVE_MS`. */
  watch(name: string, watcher: Watcher, every_ms: number = READ_MS): () => void {
    return (every_ms <= MOVE_MS ? this.#move : this.#read).watch(name, watcher);
  }

  /** Returns the latest value received, if the value is being watched. */
  latest(name: string): Reading | undefined {
    return this.#read.latest(name) ?? this.#move.latest(name);
  }

  /** Returns the latest readings of all watched values. */
  readings(): ReadonlyMap<string, Reading> {
    return new Map([...this.#read.readings(), ...this.#move.readings()]);
  }

  /** Discards all readings, because the system has restarted. */
  forget(): void {
    this.#read.forget();
    this.#move.forget();
  }

  /** Requests names again that did not exist before, because an installation may have added them. */
  renew(): void {
    this.#read.renew();
    this.#move.renew();
  }
}

interface Cell {
  watchers: Set<Watcher>;
  reading: Reading | null;
  missing: Refusal[] | null;
}

class Group {
  readonly #stream: Stream;
  readonly #every_ms: number;
  readonly #cells = new Map<string, Cell>();
  readonly #changed = new Set<string>();
  #end: (() => void) | null = null;
  #asked = "";
  #asking = false;
  #frame = 0;

  constructor(stream: Stream, every_ms: number) {
    this.#stream = stream;
    this.#every_ms = every_ms;
  }

  watch(name: string, watcher: Watcher): () => void {
    let cell = this.#cells.get(name);
    if (!cell) {
      cell = { watchers: new Set(), reading: null, missing: null };
      this.#cells.set(name, cell);
      this.#askSoon();
    } else if (cell.reading || cell.missing) {
      watcher(cell.reading, cell.missing);
    }
    const watched = cell;
    watched.watchers.add(watcher);
    return () => {
      watched.watchers.delete(watcher);
      if (watched.watchers.size > 0 || this.#cells.get(name) !== watched) return;
      this.#cells.delete(name);
      this.#askSoon();
    };
  }

  latest(name: string): Reading | undefined {
    return this.#cells.get(name)?.reading ?? undefined;
  }

  readings(): [string, Reading][] {
    return [...this.#cells].flatMap(([name, { reading }]): [string, Reading][] => (reading ? [[name, reading]] : []));
  }

  forget(): void {
    for (const [name, cell] of this.#cells) {
      cell.reading = null;
      cell.missing = null;
      this.#changed.add(name);
    }
    this.#tellSoon();
    this.#askSoon();
  }

  renew(): void {
    let any = false;
    for (const cell of this.#cells.values()) {
      any ||= cell.missing !== null;
      cell.missing = null;
    }
    if (any || !this.#end) this.#askSoon();
  }

  // A view that opens watches many values at once: they are requested together.
  #askSoon(): void {
    if (this.#asking) return;
    this.#asking = true;
    queueMicrotask(() => {
      this.#asking = false;
      this.#ask();
    });
  }

  #ask(): void {
    const names = [...this.#cells].filter(([, cell]) => !cell.missing).map(([name]) => name);
    const asked = JSON.stringify(names);
    if (asked === this.#asked && this.#end) return;
    this.#asked = asked;
    const before = this.#end;
    this.#end = null;
    before?.();
    if (names.length === 0) return;
    this.#end = this.#stream.subscribe(
      { subscribe: "svvs", names, every_ms: this.#every_ms },
      { text: (frame) => this.#take(frame), refused: (refusals) => this.#refused(names, refusals) },
    );
  }

  #take(frame: Record<string, unknown>): void {
    const { values } = frame.svvs as { values: Record<string, Reading> };
    for (const name in values) {
      const cell = this.#cells.get(name);
      const reading = values[name];
      if (!cell || !reading || sameReading(cell.reading, reading)) continue;
      cell.reading = reading;
      this.#changed.add(name);
    }
    this.#tellSoon();
  }

  #refused(names: string[], refusals: Refusal[]): void {
    this.#end = null;
    const said = refusals.map((refusal) => refusal.message).join(" ");
    const named = names.filter((name) => said.includes(`'${name}'`));
    for (const name of named.length > 0 ? named : names) {
      const cell = this.#cells.get(name);
      if (!cell) continue;
      cell.missing = refusals;
      cell.reading = null;
      this.#changed.add(name);
    }
    this.#tellSoon();
    this.#askSoon();
  }

  #tellSoon(): void {
    if (this.#frame || this.#changed.size === 0) return;
    this.#frame = requestAnimationFrame(() => {
      this.#frame = 0;
      for (const name of this.#changed) {
        const cell = this.#cells.get(name);
        if (cell) for (const watcher of cell.watchers) watcher(cell.reading, cell.missing);
      }
      this.#changed.clear();
    });
  }
}

// A write by a programming system also counts as a new value, although it has the number of the previous one.
function sameReading(one: Reading | null, other: Reading): boolean {
  return one !== null && one.number === other.number && one.time_ns === other.time_ns;
}
