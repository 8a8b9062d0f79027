// SPDX-License-Identifier: Apache-2.0
import type { Run } from "./frame";

/** A place where values are missing: in front of the value `before`. */
export interface Gap {
  /** Index of the first value behind it. */
  before: number;
  /** Values that were stored in the system and did not come. */
  lost: number;
  /** Values that came while the scope was stopped, and were not kept. */
  skipped: number;
}

/** Consecutive values as they lie in memory: `times_ns[from … to)`, and of each component the same. */
export interface Stretch {
  times_ns: Float64Array;
  columns: Float64Array[];
  from: number;
  to: number;
}

export interface Counts {
  /** Values that came. */
  received: number;
  lost: number;
  /** Of those that came: not kept, because the scope was stopped. */
  skipped: number;
}

const FIRST_CAPACITY = 1024;

/**
 * The newest values of one channel, with time and number of each, and where values are missing.
 *
 * Values have indices that only grow: `first` is the oldest that is kept, `end` one behind the newest. The memory grows until it holds
 * `keep_ns`, or `capacity_max` values; from then on the newest takes the place of the oldest.
 */
export class Ring {
  readonly components: number;
  readonly counts: Counts = { received: 0, lost: 0, skipped: 0 };
  gaps: Gap[] = [];
  keep_ns: number;
  capacity_max: number;
  #first = 0;
  #end = 0;
  #capacity = FIRST_CAPACITY;
  #times_ns = new Float64Array(FIRST_CAPACITY);
  #columns: Float64Array[];
  // The number of value i is i plus the offset of the last of these that begins at or before i.
  #offsets: { from: number; offset: number }[] = [];
  #missing = { lost: 0, skipped: 0 };
  #last: { number: number; time_ns: number } | null = null;
  #resumed = false;
  // Number in front of the first value that came.
  #origin: number | null = null;

  constructor(components: number, keep_ns: number, capacity_max: number) {
    this.components = components;
    this.keep_ns = keep_ns;
    this.capacity_max = Math.max(1, capacity_max);
    this.#columns = Array.from({ length: components }, () => new Float64Array(FIRST_CAPACITY));
  }

  get first(): number {
    return this.#first;
  }

  get end(): number {
    return this.#end;
  }

  get bytes(): number {
    return this.#capacity * 8 * (1 + this.components);
  }

  /** Time of the newest value, ns; null while there is none. */
  get newest_ns(): number | null {
    return this.#end > this.#first ? this.time_ns(this.#end - 1) : null;
  }

  get oldest_ns(): number | null {
    return this.#end > this.#first ? this.time_ns(this.#first) : null;
  }

  /** Returns the count by the numbers since the first value that came, that one included. */
  get numbered(): number {
    return this.#last && this.#origin !== null ? this.#last.number - this.#origin : 0;
  }

  /** Values that are missing behind the newest one, and have no value behind them yet. */
  get open(): { lost: number; skipped: number } {
    return this.#missing;
  }

  time_ns(index: number): number {
    return this.#times_ns[index % this.#capacity] as number;
  }

  value(index: number, component: number): number {
    return (this.#columns[component] as Float64Array)[index % this.#capacity] as number;
  }

  /** The number that the system gave the value. */
  number(index: number): number {
    let offset = 0;
    for (const one of this.#offsets) {
      if (one.from > index) break;
      offset = one.offset;
    }
    return index + offset;
  }

  /** Takes what came in one frame. What is later than `keep_until_ns` is counted, and not kept. */
  take(run: Run, keep_until_ns = Number.POSITIVE_INFINITY): void {
    let missing = run.lost;
    if (this.#resumed && this.#last && run.numbers.length > 0) {
      // The connection was broken: the numbers say how many values nobody sent.
      missing = Math.max(missing, (run.numbers[0] as number) - this.#last.number - this.#missing.lost - 1);
      this.#resumed = false;
    }
    this.counts.lost += missing;
    const { jumps, behind } = placesOf(run, missing, this.#last && this.#last.number + this.#missing.lost);
    for (let i = 0; i < run.numbers.length; i += 1) {
      this.#missing.lost += jumps.get(i) ?? 0;
      this.#takeOne(run, i, (run.times_ns[i] as number) <= keep_until_ns);
    }
    this.#missing.lost += behind;
  }

  /** The connection was made again: what is missing by number until the next value was lost. */
  resume(): void {
    this.#resumed = true;
  }

  /** Forgets all values, and counts from 0. */
  clear(): void {
    this.#first = this.#end;
    this.gaps = [];
    this.#offsets = [];
    this.#missing = { lost: 0, skipped: 0 };
    this.#last = null;
    this.#origin = null;
    Object.assign(this.counts, { received: 0, lost: 0, skipped: 0 });
  }

  /** Index of the first value at or behind `time_ns`. */
  indexAt(time_ns: number): number {
    let low = this.#first;
    let high = this.#end;
    while (low < high) {
      const middle = Math.floor((low + high) / 2);
      if (this.time_ns(middle) < time_ns) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The values `from … to`, as at most two pieces of memory. */
  stretches(from: number, to: number): Stretch[] {
    const start = Math.max(from, this.#first);
    const stop = Math.min(to, this.#end);
    if (start >= stop) return [];
    const low = start % this.#capacity;
    const high = low + (stop - start);
    const of = { times_ns: this.#times_ns, columns: this.#columns };
    if (high <= this.#capacity) return [{ ...of, from: low, to: high }];
    return [
      { ...of, from: low, to: this.#capacity },
      { ...of, from: 0, to: high - this.#capacity },
    ];
  }

  #takeOne(run: Run, i: number, keep: boolean): void {
    const time_ns = run.times_ns[i] as number;
    const number = run.numbers[i] as number;
    this.counts.received += 1;
    this.#origin ??= number - 1 - this.#missing.lost;
    this.#last = { number, time_ns };
    if (!keep) {
      this.counts.skipped += 1;
      this.#missing.skipped += 1;
      return;
    }
    this.#room(time_ns);
    if (this.#missing.lost > 0 || this.#missing.skipped > 0) {
      this.gaps.push({ before: this.#end, ...this.#missing });
      this.#missing = { lost: 0, skipped: 0 };
    }
    const offset = number - this.#end;
    if (this.#offsets.at(-1)?.offset !== offset) this.#offsets.push({ from: this.#end, offset });
    const at = this.#end % this.#capacity;
    this.#times_ns[at] = time_ns;
    for (let k = 0; k < this.components; k += 1) {
      (this.#columns[k] as Float64Array)[at] = run.values[i * this.components + k] as number;
    }
    this.#end += 1;
  }

  #room(time_ns: number): void {
    if (this.#end - this.#first < this.#capacity) return;
    if (this.#capacity < this.capacity_max && time_ns - this.time_ns(this.#first) < this.keep_ns) {
      this.#grow();
      return;
    }
    this.#first += 1;
    while (this.gaps.length > 0 && (this.gaps[0] as Gap).before <= this.#first) this.gaps.shift();
    while (this.#offsets.length > 1 && (this.#offsets[1] as { from: number }).from <= this.#first) this.#offsets.shift();
  }

  #grow(): void {
    const capacity = Math.min(this.#capacity * 2, this.capacity_max);
    const grown = (old: Float64Array) => {
      const made = new Float64Array(capacity);
      for (let i = this.#first; i < this.#end; i += 1) made[i % capacity] = old[i % this.#capacity] as number;
      return made;
    };
    this.#times_ns = grown(this.#times_ns);
    this.#columns = this.#columns.map(grown);
    this.#capacity = capacity;
  }
}

// Where in a run its lost values are missing, `last` being the number of the value before them, or of those that are known to be lost: where the numbers jump. What no jump explains is behind it; of the first run that ever comes,
// whose first number says nothing, in front of it.
function placesOf(run: Run, lost: number, last: number | null): { jumps: Map<number, number>; behind: number } {
  const jumps = new Map<number, number>();
  let left = lost;
  let before = last;
  for (let i = 0; i < run.numbers.length && left > 0; i += 1) {
    const number = run.numbers[i] as number;
    const missing = before === null ? 0 : Math.min(left, Math.max(0, number - before - 1));
    if (missing > 0) jumps.set(i, missing);
    left -= missing;
    before = number;
  }
  if (left > 0 && last === null && run.numbers.length > 0) {
    jumps.set(0, left);
    left = 0;
  }
  return { jumps, behind: left };
}
