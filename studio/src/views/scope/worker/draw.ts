// SPDX-License-Identifier: Apache-2.0
// Draws lines on a canvas, in device pixels.
import { tr } from "../../../language/text";
import type { Points } from "../signal/decimate";
import type { Range } from "../signal/ranges";
import type { Missing } from "../signal/series";

export type Canvas = OffscreenCanvasRenderingContext2D;

/** Vertical position of a scale on the screen: `lo` at `bottom`, `hi` at `top`. */
export interface PlacedScale extends Range {
  top: number;
  bottom: number;
}

export interface Pen {
  colour: string;
  pattern: number[];
  width: number;
  alpha: number;
  steps: boolean;
}

/** Values per pixel below which each value is also drawn as a point. */
const POINTS_BELOW = 1 / 8;

export function drawLine(canvas: Canvas, points: Points, on: PlacedScale, pen: Pen, width: number): void {
  const scale = (on.top - on.bottom) / (on.hi - on.lo);
  const y = (value: number) => on.bottom + (value - on.lo) * scale;
  canvas.save();
  canvas.strokeStyle = pen.colour;
  canvas.fillStyle = pen.colour;
  canvas.globalAlpha = pen.alpha;
  canvas.lineWidth = pen.width;
  canvas.setLineDash(pen.pattern);
  canvas.beginPath();
  let down = false;
  let before = 0;
  for (let i = 0; i < points.count; i += 1) {
    const value = points.y[i] as number;
    const x = points.x[i] as number;
    if (value - value !== 0) {
      down = false;
      continue;
    }
    const at = y(value);
    if (!down) canvas.moveTo(x, at);
    else {
      if (pen.steps) canvas.lineTo(x, before);
      canvas.lineTo(x, at);
    }
    before = at;
    down = true;
  }
  canvas.stroke();
  if (points.values < width * POINTS_BELOW) {
    for (let i = 0; i < points.count; i += 1) {
      const value = points.y[i] as number;
      if (value - value === 0)
        canvas.fillRect((points.x[i] as number) - 1.5 * pen.width, y(value) - 1.5 * pen.width, 3 * pen.width, 3 * pen.width);
    }
  }
  canvas.restore();
}

/** Returns the minimum and maximum of points; `low > high` if there are no points. */
export function extent(points: Points): { low: number; high: number } {
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  for (let i = 0; i < points.count; i += 1) {
    const value = points.y[i] as number;
    if (value < low && value !== Number.NEGATIVE_INFINITY) low = value;
    if (value > high && value !== Number.POSITIVE_INFINITY) high = value;
  }
  return { low, high };
}

interface Hole {
  from: number;
  to: number;
  lost: number;
  skipped: number;
}

/** Shades gaps, and labels them with the number of missing values. */
export function drawMissing(
  canvas: Canvas,
  missing: readonly Missing[],
  place: { from_ns: number; per_ns: number; width: number; height: number; ratio: number },
  ink: { bad: string; quiet: string; ground: string; font: string },
): void {
  for (const hole of joined(missing, place)) {
    const colour = hole.lost > 0 ? ink.bad : ink.quiet;
    const width = Math.max(2 * place.ratio, hole.to - hole.from);
    canvas.save();
    canvas.globalAlpha = 0.16;
    canvas.fillStyle = colour;
    canvas.fillRect(hole.from, 0, width, place.height);
    canvas.globalAlpha = 0.8;
    canvas.fillRect(hole.from, 0, place.ratio, place.height);
    canvas.fillRect(hole.from + width - place.ratio, 0, place.ratio, place.height);
    canvas.globalAlpha = 1;
    label(canvas, holeText(hole), hole.from + width / 2, place, colour, ink);
    canvas.restore();
  }
}

function joined(missing: readonly Missing[], place: { from_ns: number; per_ns: number; width: number; ratio: number }): Hole[] {
  const x = (time_ns: number) => Math.min(place.width, Math.max(0, (time_ns - place.from_ns) * place.per_ns));
  const holes = missing
    .map((one) => ({ from: x(one.from_ns), to: x(one.to_ns), lost: one.lost, skipped: one.skipped }))
    .sort((a, b) => a.from - b.from);
  const made: Hole[] = [];
  for (const hole of holes) {
    const last = made.at(-1);
    if (!last || hole.from > last.to + 4 * place.ratio) made.push(hole);
    else {
      last.to = Math.max(last.to, hole.to);
      last.lost += hole.lost;
      last.skipped += hole.skipped;
    }
  }
  return made;
}

function holeText({ lost, skipped }: Hole): string {
  if (lost === 0) return tr("scope.stoppedSkippedDiscarded", { skipped });
  return skipped > 0 ? tr("scope.lostLostSkippedDiscarded", { lost, skipped }) : tr("scope.lostLost", { lost });
}

function label(
  canvas: Canvas,
  text: string,
  x: number,
  place: { width: number; ratio: number },
  colour: string,
  ink: { ground: string; font: string },
): void {
  canvas.font = ink.font;
  const size = canvas.measureText(text).width + 8 * place.ratio;
  const left = Math.min(place.width - size, Math.max(0, x - size / 2));
  canvas.fillStyle = ink.ground;
  canvas.fillRect(left, 2 * place.ratio, size, 16 * place.ratio);
  canvas.strokeStyle = colour;
  canvas.lineWidth = place.ratio;
  canvas.strokeRect(left, 2 * place.ratio, size, 16 * place.ratio);
  canvas.fillStyle = colour;
  canvas.textBaseline = "middle";
  canvas.fillText(text, left + 4 * place.ratio, 10.5 * place.ratio);
}
