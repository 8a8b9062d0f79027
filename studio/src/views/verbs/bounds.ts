// SPDX-License-Identifier: Apache-2.0
// Limits of inputs: numbers, or parameters of the selected devices (`arm.max_speed`, `-arm.max_speed`).
import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import type { Value, VerbForm } from "../../control/shapes";
import type { Source } from "../../control/source";
import { useControl } from "../../shell/context";
import type { Choices } from "./arguments";

/** Minimum and maximum of an input, by device; a single value if all are equal. */
export interface Bounds {
  minimum: Value[];
  maximum: Value[];
}

export function useBounds(form: VerbForm, choices: Choices): Map<string, Bounds> {
  const control = useControl();
  const [bounds, setBounds] = useState<Map<string, Bounds>>(new Map());
  const chosen = JSON.stringify(choices);
  useEffect(() => {
    const known = JSON.parse(chosen) as Choices;
    const inputs = form.inputs.filter((input) => input.minimum !== null || input.maximum !== null);
    return askUntilAnswered(control, {
      ask: (signal) =>
        Promise.all(
          inputs.map(async (input): Promise<[string, Bounds]> => {
            const bounds = [input.minimum, input.maximum].map((bound) => ends(control, bound, known, signal));
            const [minimum = [], maximum = []] = await Promise.all(bounds);
            return [input.name, { minimum, maximum }];
          }),
        ),
      take: (found) => setBounds(new Map(found)),
      // If they cannot be read, the form shows the names of the limits, and the system checks the values anyway.
      failed: () => setBounds(new Map()),
    });
  }, [control, form, chosen]);
  return bounds;
}

async function ends(control: Source, bound: Value, choices: Choices, signal: AbortSignal): Promise<Value[]> {
  const member = memberOf(bound);
  if (!member) return [bound];
  const devices = choices[member.argument] ?? [];
  const values = await Promise.all(devices.map((name) => control.look("device_parameter", { name, parameter: member.parameter }, signal)));
  const signed = values.map((value) => (member.negative && typeof value === "number" ? -value : value));
  return signed.every((value) => value === signed[0]) ? signed.slice(0, 1) : signed;
}

/** Splits `-arm.max_speed` into its components; returns null if it is not a member of an argument. */
export function memberOf(bound: Value): { argument: string; parameter: string; negative: boolean } | null {
  const found = typeof bound === "string" ? /^(-?)(\w+)\.(\w+)$/.exec(bound) : null;
  return found ? { negative: found[1] === "-", argument: found[2] ?? "", parameter: found[3] ?? "" } : null;
}
