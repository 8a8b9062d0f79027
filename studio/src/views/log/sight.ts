// SPDX-License-Identifier: Apache-2.0
// Visible rows among many rows of equal height.

/** Visible part of the rows: its top and its height, px. */
export interface Sight {
  top: number;
  height: number;
}

/**
 * Number of rows rendered beyond the visible part: enough to scroll without gaps, but only one if a jump of the cursor replaces all
 * rows.
 */
export const BEYOND = { scrolled: 6, jumped: 1 };

/** Returns the half-open range of rows to render. */
export function rowsInSight(sight: Sight, rows: number, row_px: number, beyond: number): [number, number] {
  const first = Math.max(0, Math.floor(sight.top / row_px) - beyond);
  return [first, Math.min(rows, Math.ceil((sight.top + sight.height) / row_px) + beyond)];
}

/** Returns the visible part after scrolling to a row: unchanged if the row is already visible, otherwise with the row in the middle. */
export function broughtIntoSight(sight: Sight, row: number, rows: number, row_px: number): Sight {
  const place = row * row_px;
  if (place >= sight.top && place + row_px <= sight.top + sight.height) return sight;
  const top = Math.min(place - sight.height / 2, rows * row_px - sight.height);
  return { ...sight, top: Math.max(0, Math.round(top)) };
}
