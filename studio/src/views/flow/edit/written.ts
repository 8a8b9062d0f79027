// SPDX-License-Identifier: Apache-2.0
// What a person writes into the fields of the editor.
import type { Value } from "../../../control/shapes";
import { durationNs, type Read } from "../../../design/quantities";

/** The names in a text: "near.done, near.lost". */
export function words(text: string): string[] {
  return text.split(/[\s,]+/).filter(Boolean);
}

/** What a person writes as a value of a type: a number, a truth, a list. Nothing is the default. */
export function constantOf(text: string, type_text: string): { value: Value | undefined; wrong: string | null } {
  if (text === "") return { value: undefined, wrong: null };
  try {
    return { value: JSON.parse(text) as Value, wrong: null };
  } catch {
    return { value: undefined, wrong: `'${text}' is no ${type_text}: write a number, true, false, or a list [1, 2]` };
  }
}

/** What a person writes as an interval, ns; null: none. */
export function everyOf(text: string): Read<number | null> {
  if (text === "") return { value: null };
  const read = durationNs(text);
  return read.wrong !== undefined || read.value > 0 ? read : { wrong: `'${text}' is no interval: it must be more than 0` };
}
