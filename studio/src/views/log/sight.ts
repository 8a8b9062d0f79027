// SPDX-License-Identifier: Apache-2.0
// Rows of one height that are seen, among many.

/** Part of the rows that is seen, px: its beginning, and its height. */
export interface Sight {
  top: number;
  height: number;
}

/** Rows drawn beyond what is seen: so many that a wheel shows no empty place, and one where a cursor that jumps brings all others anyway. */
export const BEYOND = { scrolled: 6, jumped: 1 };

/** The rows that are drawn: from the first, up to but not including the second. */
export function rowsInSight(sight: Sight, rows: number, row_px: number, beyond: number): [number, number] {
  const first = Math.max(0, Math.floor(sight.top / row_px) - beyond);
  return [first, Math.min(rows, Math.ceil((sight.top + sight.height) / row_px) + beyond)];
}

/** Returns the view once a row is seen: the same if it is seen already, else with the row in the middle. */
export function broughtIntoSight(sight: Sight, row: number, rows: number, row_px: number): Sight {
  const place = row * row_px;
  if (place >= sight.top && place + row_px <= sight.top + sight.height) return sight;
  const top = Math.min(place - sight.height / 2, rows * row_px - sight.height);
  return { ...sight, top: Math.max(0, Math.round(top)) };
}
