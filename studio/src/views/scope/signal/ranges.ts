// SPDX-License-Identifier: Apache-2.0

export interface Range {
  lo: number;
  hi: number;
}

/** Returns a range with round limits that contains `low … high` with some margin. */
export function roundRange(low: number, high: number): Range {
  if (!(low <= high)) return { lo: -1, hi: 1 };
  const size = high - low || Math.abs(high) || 1;
  const air = (high - low) * 0.05 || size * 0.1;
  const step = roundStep((size + 2 * air) / 8);
  return { lo: Math.floor((low - air) / step) * step, hi: Math.ceil((high + air) / step) * step };
}

/** Returns the smallest 1, 2 or 5 times a power of ten that is at least `size`. */
export function roundStep(size: number): number {
  const power = 10 ** Math.floor(Math.log10(size));
  const part = size / power;
  return (part <= 1 ? 1 : part <= 2 ? 2 : part <= 5 ? 5 : 10) * power;
}

/** Ranges that follow the values, but stay constant as long as the values fill them well, because a jumping axis is unreadable. */
export class Ranges {
  readonly #kept = new Map<string, Range>();

  of(key: string, low: number, high: number): Range {
    const before = this.#kept.get(key);
    if (before && low >= before.lo && high <= before.hi && high - low >= 0.4 * (before.hi - before.lo)) return before;
    if (before && !(low <= high)) return before;
    const made = roundRange(low, high);
    this.#kept.set(key, made);
    return made;
  }

  forget(): void {
    this.#kept.clear();
  }
}
