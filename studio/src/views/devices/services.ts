// SPDX-License-Identifier: Apache-2.0
// Services of drivers: converts form input to the arguments of `device_service`.

import type { DriverOption, DriverService, Value } from "../../control/shapes";
import { valueText } from "../../design/numbers";
import { numberIn, type ReadResult } from "../../design/quantities";
import { tr } from "../../language/text";

/**
 * Parses the text of one argument; undefined if it is empty and has a default. A number may have a unit, and is converted to the
 * argument's unit.
 */
export function argumentFrom(text: string, of: DriverOption): ReadResult<unknown> {
  const written = text.trim();
  if (written === "") return of.default === null ? { wrong: tr("devices.enterAValue") } : { value: undefined };
  switch (of.kind) {
    case "number":
      return numberIn(written, of.unit);
    case "whole": {
      const hexadecimal = /^0x[0-9a-f]+$/i.test(written);
      const read = hexadecimal ? { value: Number(written) } : numberIn(written, of.unit);
      if (read.wrong !== undefined || Number.isSafeInteger(read.value)) return read;
      return { wrong: tr("devices.writtenIsNotAnInteger", { written }) };
    }
    case "bool":
      return written === "true" || written === "false" ? { value: written === "true" } : { wrong: tr("devices.chooseTrueOrFalse") };
    case "list":
    case "table":
      return parsed(written, of.kind);
    default:
      return { value: text };
  }
}

function parsed(written: string, kind: "list" | "table"): ReadResult<unknown> {
  try {
    const value: unknown = JSON.parse(written);
    if (kind === "list" ? Array.isArray(value) : typeof value === "object" && value !== null && !Array.isArray(value)) return { value };
  } catch {
    // The error below includes an example.
  }
  return {
    wrong: kind === "list" ? tr("devices.writtenIsNotAListWrite", { written }) : tr("devices.writtenIsNotATableWrite", { written }),
  };
}

/** Returns the arguments of a service that are not empty, and the errors by argument. */
export function argumentsOfService(
  service: DriverService,
  texts: Record<string, string>,
): { given: Record<string, unknown>; wrong: Record<string, string> } {
  const given: Record<string, unknown> = {};
  const wrong: Record<string, string> = {};
  for (const option of service.arguments) {
    const read = argumentFrom(texts[option.name] ?? "", option);
    if (read.wrong !== undefined) wrong[option.name] = read.wrong;
    else if (read.value !== undefined) given[option.name] = read.value;
  }
  return { given, wrong };
}

/** Formats the answer of a service as text; a list has one line per item. */
export function answerText(answer: Value | null): string {
  if (answer === null) return "done";
  if (Array.isArray(answer)) return answer.length === 0 ? "nothing" : answer.map((one) => valueText(one)).join("\n");
  return valueText(answer);
}
