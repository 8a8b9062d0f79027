// SPDX-License-Identifier: Apache-2.0
import type { Run } from "./frame";

/** Missing values before the value with the index `before`. */
export interface Gap {
  /** Index of the first value after the gap. */
  before: number;
  /** Number of values that were stored in the system but not received. */
  lost: number;
  /** Number of values that were received while the scope was stopped, and discarded. */
  skipped: number;
}

/** Consecutive values in memory: `times_ns[from … to)`, and likewise for each component. */
export interface Stretch {
  times_ns: Float64Array;
  columns: Float64Array[];
  from: number;
  to: number;
}

export interface Counts {
  /** Number of received values. */
  received: number;
  lost: number;
  /** Number of received values that were discarded because the scope was stopped. */
  skipped: number;
}

const FIRST_CAPACITY = 1024;

/**
 * The most recent values of one channel, each with its time and number, and the gaps between them.
 *
 * The indices of values increase: `first` is the index of the oldest stored value, `end` is one past the index of the latest. The memory
 * grows until it holds `keep_ns`, or `capacity_max` values; then new values overwrite the oldest.
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
  // The number of value i is i plus the offset of the last entry whose `from` is not greater than i.
  #offsets: { from: number; offset: number }[] = [];
  #missing = { lost: 0, skipped: 0 };
  #last: { number: number; time_ns: number } | null = null;
  #resumed = false;
  // Number before that of the first value.
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

  /** Time of the latest value, ns; null if there is none. */
  get newest_ns(): number | null {
    return this.#end > this.#first ? this.time_ns(this.#end - 1) : null;
  }

  get oldest_ns(): number | null {
    return this.#end > this.#first ? this.time_ns(this.#first) : null;
  }

  /** Number of values since the first, according to their numbers. */
  get numbered(): number {
    return this.#last && this.#origin !== null ? this.#last.number - this.#origin : 0;
  }

  /** Number of missing values after the latest one. */
  get open(): { lost: number; skipped: number } {
    return this.#missing;
  }

  time_ns(index: number): number {
    return this.#times_ns[index % this.#capacity] as number;
  }

  value(index: number, component: number): number {
    return (this.#columns[component] as Float64Array)[index % this.#capacity] as number;
  }

  /** Returns the number that the system assigned to the value. */
  number(index: number): number {
    let offset = 0;
    for (const one of this.#offsets) {
      if (one.from > index) break;
      offset = one.offset;
    }
    return index + offset;
  }

  /** Adds the values of one frame. Values later than `keep_until_ns` are counted but not stored. */
  take(run: Run, keep_until_ns = Number.POSITIVE_INFINITY): void {
    let missing = run.lost;
    if (this.#resumed && this.#last && run.numbers.length > 0) {
      // The connection was broken: the numbers show how many values were never sent.
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

  /** Records a reconnection: values that are missing before the next one, according to its number, count as lost. */
  resume(): void {
    this.#resumed = true;
  }

  /** Discards all values and resets the counts. */
  clear(): void {
    this.#first = this.#end;
    this.gaps = [];
    this.#offsets = [];
    this.#missing = { lost: 0, skipped: 0 };
    this.#last = null;
    this.#origin = null;
    Object.assign(this.counts, { received: 0, lost: 0, skipped: 0 });
  }

  /** Returns the index of the first value at or after `time_ns`. */
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

  /** Returns the values `from … to`, in at most two memory segments. */
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

// Locates the lost values in a run: where the numbers jump. `last` is the number of the previous value, including those known to be
// lost. Losses that no jump explains are after the run; in the very first run, whose first number proves nothing, they are before it.
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
