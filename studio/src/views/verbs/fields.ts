// SPDX-License-Identifier: Apache-2.0
// Converts form input to the arguments of a start. Units and limits are checked by the system: text with a unit ("90 deg", "30 %") is sent
// unchanged.

import type { Refusal } from "../../control/refusals";
import type { Value } from "../../control/shapes";
import { commaIn, numberIn } from "../../design/quantities";
import { unitText } from "../../design/units";
import { tr } from "../../language/text";

/** Returns the number of elements of an input: six for `double[6]`, the number of chosen devices for `double[n]`, null for a scalar. */
export function elements(type_text: string, devices: number): number | null {
  const found = /\[\s*(\w+)\s*\]\s*$/.exec(type_text);
  if (!found) return null;
  const size = Number(found[1]);
  return Number.isInteger(size) ? size : Math.max(1, devices);
}

/** Parses the text of one field; undefined if it is empty. Lists and structs are parsed as JSON. */
export function valueFrom(text: string, type_text: string): Value | undefined {
  const written = text.trim();
  if (written === "") return undefined;
  if (/^bool/.test(type_text)) {
    if (written === "true") return true;
    if (written === "false") return false;
    return written;
  }
  if (/^[[{]/.test(written)) {
    try {
      return JSON.parse(written) as Value;
    } catch {
      return written;
    }
  }
  const number = Number(written.replace(/^\+/, ""));
  return Number.isFinite(number) ? number : written;
}

/** Formats the current value of an input as it would be typed: numbers with nine digits, lists and structs as JSON. */
export function presentText(value: Value | undefined): string {
  if (value === null || value === undefined) return "";
  if (typeof value === "string") return value;
  return JSON.stringify(value, (_, one) => (typeof one === "number" ? Number(one.toPrecision(9)) : one));
}

/** Returns a sentence that explains why the text of a field cannot be sent; null if only the system can check it. */
export function wrongText(text: string, type_text: string): string | null {
  const written = text.trim();
  if (written === "") return null;
  if (/^bool/.test(type_text)) return written === "true" || written === "false" ? null : tr("verbs.writtenIsNotABooleanWrite", { written });
  if (/^[[{]/.test(written)) {
    try {
      JSON.parse(written);
      return null;
    } catch {
      return tr("verbs.writtenIsNeitherAListNor", { written });
    }
  }
  return commaIn(written);
}

/** Returns the value of an array input, with null for empty elements; undefined if all are empty. */
export function arrayOf(texts: string[], type_text: string): Value | undefined {
  const scalar = type_text.replace(/\[.*$/, "");
  const values = texts.map((text) => valueFrom(text, scalar));
  if (values.every((value) => value === undefined)) return undefined;
  return values.map((value) => value ?? null);
}

/** Returns the indices of empty elements if others are filled. */
export function gaps(texts: string[]): number[] {
  const empty = texts.flatMap((text, index) => (text.trim() === "" ? [index] : []));
  return empty.length === texts.length ? [] : empty;
}

/** Formats a default or a limit: numbers with their unit, lists separated by commas. */
export function limitText(value: Value, unit: string | null): string {
  if (value === null || value === undefined) return "";
  if (typeof value === "number") return `${Number(value.toPrecision(6))}${unit ? `\u202f${unitText(unit)}` : ""}`;
  if (Array.isArray(value)) return value.map((one) => limitText(one, null)).join(", ") + (unit ? `\u202f${unitText(unit)}` : "");
  return String(value);
}

/** Returns whether a unit is a unit of position, so that the current position of the joints can be filled in. */
export function isPosition(unit: string | null): boolean {
  return (unit ?? "").split("|").some((one) => one === "rad" || one === "m");
}

/** Converts between angle units: "90°" for 1.5708, "1.571 rad" for "90 deg". Returns an empty string if the text is not an angle. */
export function degreesOf(text: string, unit: string | null): string {
  const inDegrees = /deg|°/.test(text);
  if (unit === null || !unit.split("|").some((one) => /^rad\b/.test(one)) || text.trim() === "" || (unit.includes("|") && !inDegrees))
    return "";
  const target = unit.split("|").find((one) => /^rad\b/.test(one)) ?? "rad";
  const { value } = numberIn(text, target);
  if (value === undefined) return "";
  return inDegrees ? `${Number(value.toPrecision(4))} ${target}` : degreesText(value, target);
}

function degreesText(value: number, unit: string): string {
  return `${Number(((value * 180) / Math.PI).toPrecision(4))}°${unit.slice("rad".length)}`;
}

/** Formats one end of a range with four digits, which suffice for choosing a goal. Angles are also given in degrees. */
export function endText(value: Value, unit: string | null): string {
  if (typeof value !== "number") return limitText(value, null);
  const short = String(Number(value.toPrecision(4)));
  // For a choice of units, the actual one is unknown, so no degrees are shown.
  return unit !== null && /^rad\b/.test(unit) && !unit.includes("|") ? `${short} (${degreesText(value, unit)})` : short;
}

/** Formats the range of one element if the elements have different ranges. */
export function limitsAt(bounds: { minimum: Value[]; maximum: Value[] } | null, index: number, unit: string | null): string {
  if (!bounds || (bounds.minimum.length <= 1 && bounds.maximum.length <= 1)) return "";
  const at = (ends: Value[]) => endText((ends.length > 1 ? ends[index] : ends[0]) ?? null, unit);
  return tr("verbs.minimumToMaximum", { minimum: at(bounds.minimum), maximum: at(bounds.maximum) });
}

/** Splits refusals into those that name an input or argument, and all others. */
export function byField(refusals: Refusal[], names: string[]): { of: Map<string, Refusal[]>; rest: Refusal[] } {
  const of = new Map<string, Refusal[]>();
  const rest: Refusal[] = [];
  for (const refusal of refusals) {
    const name = names.find((one) => refusal.message.includes(`'${one}'`) || refusal.ends?.some((end) => end.what.includes(`'${one}'`)));
    if (name === undefined) rest.push(refusal);
    else of.set(name, [...(of.get(name) ?? []), refusal]);
  }
  return { of, rest };
}
