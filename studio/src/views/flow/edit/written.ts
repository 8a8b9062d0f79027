// SPDX-License-Identifier: Apache-2.0
// Texts typed into the fields of the editor.

import type { Value } from "../../../control/shapes";
import { durationNs, type ReadResult } from "../../../design/quantities";
import { tr } from "../../../language/text";
import type { Bound } from "./definition";

/** Splits a list of names: "near.done, near.lost". */
export function words(text: string): string[] {
  return text.split(/[\s,]+/).filter(Boolean);
}

/** Pattern of a number with its unit: "3 Hz", "2 N.m/rad". */
const QUANTITY = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?\s*[a-zµ°Ω%][\w./*^µ°Ω|-]*$/i;

/** Parses text entered by a person as a value of a type: a number, a Boolean or a list. Empty text means the default. */
export function constantOf(text: string, type_text: string): { value: Value | undefined; wrong: string | null } {
  if (text === "") return { value: undefined, wrong: null };
  // A list of numbers needs no brackets: 0, 0, 1.
  const several = text.split(/,\s+/).map(Number);
  if (several.length > 1 && several.every(Number.isFinite)) return { value: several, wrong: null };
  // The system decides which units are allowed: it converts them, or the check reports the expected unit.
  if (type_text !== "bool" && QUANTITY.test(text)) return { value: text, wrong: null };
  try {
    return { value: JSON.parse(text) as Value, wrong: null };
  } catch {
    return {
      value: undefined,
      wrong: tr("flow.textIsNotATypeText", { text, type_text }),
    };
  }
}

/** Parses text entered by a person as the value of an input parameter: a constant, or a percentage of the parameter's maximum, "25 %". */
export function givenOf(text: string): { value: Value | undefined; wrong: string | null } {
  if (/^-?\d+(\.\d+)?\s*%$/.test(text)) return { value: text, wrong: null };
  return constantOf(text, "value");
}

/** Formats a constant; lists of numbers are formatted without brackets. */
export function constantText(value: Value | undefined): string {
  if (value === undefined || value === null) return "";
  if (typeof value === "string") return value;
  const isPlain = Array.isArray(value) && value.length > 1 && value.every((one) => typeof one === "number");
  return isPlain ? value.join(", ") : JSON.stringify(value);
}

/** Parses text entered by a person as an interval, ns; null if the text is empty. */
export function everyOf(text: string): ReadResult<number | null> {
  if (text === "") return { value: null };
  const read = durationNs(text);
  return read.wrong !== undefined || read.value > 0 ? read : { wrong: tr("flow.textIsNotAnIntervalIt", { text }) };
}

/** Parses the range of an input parameter, given as numbers or parameters of objects: "0, arm.max_speed". Empty text means no range. */
export function withinOf(text: string): ReadResult<[Bound, Bound] | null> {
  if (text === "") return { value: null };
  const ends = text.split(/[\s,]+/).filter(Boolean);
  const [low, high] = ends.map((end): Bound => (Number.isFinite(Number(end)) ? Number(end) : end));
  if (ends.length !== 2 || low === undefined || high === undefined) return { wrong: tr("flow.textIsNotARangeWrite", { text }) };
  return { value: [low, high] };
}
