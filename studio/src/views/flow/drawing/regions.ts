// SPDX-License-Identifier: Apache-2.0
// A drawing by interrupt sources: one column each, with the boxes that run there.
import { type Box, type Place, sizeOf } from "./drawing";

/** An area of the drawing for the boxes of an interrupt source; if `source` is null, for boxes that are not placed. */
export interface Region {
  source: string | null;
  title: string;
  x: number;
  y: number;
  width: number;
  height: number;
}

/** The regions of a drawing, and the positions of its boxes. */
export interface GroupedDrawing {
  regions: Region[];
  places: Map<string, Place>;
}

/** Maximum number of boxes in a column of a region; further boxes start a new column. */
const IN_A_COLUMN = 12;
const [GAP, HEAD, PAD, NARROWEST, LOWEST] = [60, 64, 20, 180, 160];

/**
 * Arranges the boxes in one region per source, from left to right, and one region for boxes that are not placed. Each region is filled
 * from the top.
 */
export function grouped(
  boxes: readonly Box[],
  sources: readonly string[],
  sourceOf: (box: Box) => string | null,
  unplaced: string,
): GroupedDrawing {
  const named = [...new Set([...sources, ...boxes.flatMap((box) => sourceOf(box) ?? [])])];
  const places = new Map<string, Place>();
  const regions: Region[] = [];
  let x = 0;
  for (const source of [null, ...named]) {
    const own = boxes.filter((box) => sourceOf(box) === source);
    if (source === null && own.length === 0 && named.length > 0 && boxes.length > 0) continue;
    let [left, height] = [x + PAD, HEAD];
    for (let first = 0; first < own.length; first += IN_A_COLUMN) {
      let [y, wide] = [HEAD, 0];
      for (const box of own.slice(first, first + IN_A_COLUMN)) {
        const size = sizeOf(box);
        places.set(box.id, { x: left, y });
        y += size.height + PAD;
        wide = Math.max(wide, size.width);
      }
      left += wide + PAD;
      height = Math.max(height, y);
    }
    const width = Math.max(NARROWEST, left - x);
    regions.push({ source, title: source ?? unplaced, x, y: 0, width, height });
    x += width + GAP;
  }
  // All regions get the height of the highest, so that a box dropped below the others is still inside.
  const height = Math.max(LOWEST, ...regions.map((region) => region.height));
  return { regions: regions.map((region) => ({ ...region, height })), places };
}

/** Returns the region that contains a point. */
export function regionAt(regions: readonly Region[], at: Place): Region | undefined {
  return regions.find(({ x, y, width, height }) => at.x >= x && at.x <= x + width && at.y >= y && at.y <= y + height);
}
