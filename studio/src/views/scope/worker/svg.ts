// SPDX-License-Identifier: Apache-2.0
// Draws the screen as vector lines, in CSS pixels.
import { tr } from "../../../language/text";
import type { Show, ShownTrace } from "../messages";
import type { Points } from "../signal/decimate";
import { labelsOf, rangeText } from "../signal/labels";
import type { Range } from "../signal/ranges";
import { stepOf, ticks } from "../signal/ticks";
import type { PlacedScale } from "./draw";

const [LEFT, RIGHT, TOP, BOTTOM, LEGEND] = [70, 16, 12, 44, 18];
/** Maximum length of a label, characters. */
const ROOM = 8;
const FONT = 'font-family="sans-serif" font-size="12"';

/** A trace as drawn, and the trace shown behind it. */
export interface Line {
  trace: ShownTrace;
  points: Points;
  earlier: Points | null;
}

/** A trace with its position on the screen and the key of its scale. */
export interface PlacedLine extends Line {
  on: PlacedScale;
  key: string;
}

/** Range of the x axis and the unit of its labels; a label is the value times `per`. */
export interface Along extends Range {
  unit: string;
  per: number;
}

/**
 * Returns the lines as SVG with axes and a legend. Only the first scale of a plot has an axis; the legend contains the ranges of the
 * other scales.
 */
export function svg(lines: readonly PlacedLine[], show: Show, along: Along): string {
  const width = show.width / show.ratio;
  const height = show.height / show.ratio;
  const size = [LEFT + width + RIGHT, TOP + height + BOTTOM + LEGEND * lines.length];
  const parts = [
    `<svg xmlns="http://www.w3.org/2000/svg" width="${figure(size[0])}" height="${figure(size[1])}" viewBox="0 0 ${figure(size[0])} ${figure(size[1])}">`,
    `<rect width="100%" height="100%" fill="${escaped(show.ink.ground)}"/>`,
    `<svg x="${LEFT}" y="${TOP}" width="${figure(width)}" height="${figure(height)}" overflow="hidden">`,
    ...lines.flatMap((line) => [...(line.earlier ? [path(line.earlier, line, show, 1, 0.45)] : []), path(line.points, line, show, 1.5, 1)]),
    "</svg>",
    ...axes(lines, show, along, width, height),
    ...lines.map((line, i) => legend(line, i, lines, TOP + height + BOTTOM + LEGEND * i, show)),
    "</svg>",
  ];
  return `${parts.join("\n")}\n`;
}

function path(points: Points, { trace, on }: PlacedLine, show: Show, width: number, alpha: number): string {
  const scale = (on.top - on.bottom) / (on.hi - on.lo);
  const said: string[] = [];
  let down = false;
  let before = 0;
  for (let i = 0; i < points.count; i += 1) {
    const value = points.y[i] as number;
    if (value - value !== 0) {
      down = false;
      continue;
    }
    const x = (points.x[i] as number) / show.ratio;
    const y = (on.bottom + (value - on.lo) * scale) / show.ratio;
    if (down && show.steps) said.push(`L${figure(x)} ${figure(before)}`);
    said.push(`${down ? "L" : "M"}${figure(x)} ${figure(y)}`);
    before = y;
    down = true;
  }
  const dashes = trace.pattern.length > 0 ? ` stroke-dasharray="${trace.pattern.join(" ")}"` : "";
  return `<path d="${said.join("")}" fill="none" stroke="${escaped(trace.colour)}" stroke-width="${width}" stroke-opacity="${alpha}"${dashes}/>`;
}

function axes(lines: readonly PlacedLine[], show: Show, along: Along, width: number, height: number): string[] {
  const ink = escaped(show.ink.quiet);
  const line = (x1: number, y1: number, x2: number, y2: number, alpha: number) =>
    `<line x1="${figure(x1)}" y1="${figure(y1)}" x2="${figure(x2)}" y2="${figure(y2)}" stroke="${ink}" stroke-opacity="${alpha}"/>`;
  const text = (x: number, y: number, anchor: string, said: string) =>
    `<text x="${figure(x)}" y="${figure(y)}" text-anchor="${anchor}" fill="${ink}" ${FONT}>${escaped(said)}</text>`;
  const { lo, hi, unit, per } = along;
  const marks = marksOf(lo * per, hi * per, Math.max(2, width / 110));
  const made = marks.ticks.flatMap((tick, i) => {
    const x = LEFT + ((tick / per - lo) / (hi - lo)) * width;
    return [line(x, TOP, x, TOP + height, 0.2), text(x, TOP + height + 16, "middle", marks.texts[i] ?? "")];
  });
  made.push(text(LEFT + width, TOP + height + 34, "end", `${marks.common} ${unit}`.trim()));
  made.push(line(LEFT, TOP + height, LEFT + width, TOP + height, 1), line(LEFT, TOP, LEFT, TOP + height, 1));
  if (show.scales === "lanes") return made;
  for (const { on } of lines.filter((one) => firstOf(one, lines) === one)) {
    const up = marksOf(on.lo, on.hi, Math.max(2, (on.bottom - on.top) / show.ratio / 60));
    if (up.common !== "") made.push(text(LEFT + 4, TOP + on.top / show.ratio + 12, "start", up.common));
    for (const [i, tick] of up.ticks.entries()) {
      const y = TOP + (on.bottom + ((tick - on.lo) / (on.hi - on.lo)) * (on.top - on.bottom)) / show.ratio;
      made.push(line(LEFT, y, LEFT + width, y, 0.2), text(LEFT - 6, y + 4, "end", up.texts[i] ?? ""));
    }
    const border = TOP + on.top / show.ratio;
    if (on.top > 0) made.push(line(LEFT, border, LEFT + width, border, 1));
  }
  return made;
}

/** Returns round tick marks from `lo` to `hi`, and their labels. */
function marksOf(lo: number, hi: number, count: number): { ticks: number[]; texts: string[]; common: string } {
  const found = ticks(lo, hi, count);
  return { ticks: found, ...labelsOf(found, stepOf(lo, hi, count), ROOM) };
}

/** Returns the first line in the same plot as `one`; the axis of the plot shows the scale of that line. */
function firstOf(one: PlacedLine, lines: readonly PlacedLine[]): PlacedLine | undefined {
  return lines.find((other) => other.on.top === one.on.top);
}

function legend(line: PlacedLine, i: number, lines: readonly PlacedLine[], y: number, show: Show): string {
  const { trace, on } = line;
  const hasAxis = show.scales !== "lanes" && line.key === firstOf(line, lines)?.key;
  const range = hasAxis ? "" : `, ${rangeText(on.lo, on.hi)}`;
  const said = `${trace.id}${trace.unit ? ` (${trace.unit})` : ""}${range}${line.earlier ? tr("scope.fainterBehindIt") : ""}`;
  const dashes = trace.pattern.length > 0 ? ` stroke-dasharray="${trace.pattern.join(" ")}"` : "";
  const mark = `<line x1="${LEFT}" y1="${figure(y)}" x2="${LEFT + 26}" y2="${figure(y)}" stroke="${escaped(trace.colour)}" stroke-width="2.5"${dashes}/>`;
  return `${mark}<text x="${LEFT + 34}" y="${figure(y + 4)}" fill="${escaped(show.ink.text)}" ${FONT} data-line="${i}">${escaped(said)}</text>`;
}

function figure(value: number | undefined): string {
  return String(Math.round((value ?? 0) * 100) / 100);
}

function escaped(text: string): string {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");
}
