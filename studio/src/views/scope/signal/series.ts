// SPDX-License-Identifier: Apache-2.0
import type { Ring } from "./ring";

/** A segment of a trace without gaps: `from … to` of both arrays. */
export interface Piece {
  times_ns: Float64Array;
  values: Float64Array;
  from: number;
  to: number;
  /** True if values are missing before the segment. */
  broken: boolean;
}

/** Values to be drawn, measured and exported: segments in time order. */
export type Series = Piece[];

/** Missing values of a channel between `from_ns` and `to_ns`, both exclusive. */
export interface Missing {
  from_ns: number;
  to_ns: number;
  lost: number;
  skipped: number;
}

/**
 * Returns the values of one component between two times, plus one value on each side, so that lines continue to the edges of the screen.
 */
export function seriesOf(ring: Ring, component: number, from_ns: number, to_ns: number): Series {
  return piecesOf(ring, component, Math.max(ring.first, ring.indexAt(from_ns) - 1), Math.min(ring.end, ring.indexAt(to_ns) + 1));
}

function piecesOf(ring: Ring, component: number, from: number, to: number): Series {
  const breaks = ring.gaps.filter((gap) => gap.before > from && gap.before < to).map((gap) => gap.before);
  const borders = [from, ...breaks, to];
  const pieces: Series = [];
  for (let i = 0; i + 1 < borders.length; i += 1) {
    let broken = i > 0;
    for (const stretch of ring.stretches(borders[i] as number, borders[i + 1] as number)) {
      const values = stretch.columns[component] as Float64Array;
      pieces.push({ times_ns: stretch.times_ns, values, from: stretch.from, to: stretch.to, broken });
      broken = false;
    }
  }
  return pieces;
}

/** Returns the spans between two times in which values of a channel are missing. The last span may be open, with an infinite `to_ns`. */
export function missingIn(ring: Ring, from_ns: number, to_ns: number): Missing[] {
  const found: Missing[] = [];
  for (const { before, lost, skipped } of ring.gaps) {
    const start = before > ring.first ? ring.time_ns(before - 1) : Number.NEGATIVE_INFINITY;
    const stop = ring.time_ns(before);
    if (stop >= from_ns && start <= to_ns) found.push({ from_ns: start, to_ns: stop, lost, skipped });
  }
  const newest = ring.newest_ns;
  const { lost, skipped } = ring.open;
  if (newest !== null && lost + skipped > 0 && newest <= to_ns)
    found.push({ from_ns: newest, to_ns: Number.POSITIVE_INFINITY, lost, skipped });
  return found;
}
