// SPDX-License-Identifier: Apache-2.0
// Messages about values beyond their limits.

import type { ShownValue, Value } from "../../control/shapes";
import { figure, withUnit } from "../../design/numbers";
import { tr } from "../../language/text";

/**
 * Describes how a value exceeds its limits: "above 2 m", "below 0 m"; null if it is within them. For an array, each element is checked.
 */
export function beyond(value: Value | null | undefined, of: ShownValue, unit: string): string | null {
  if (Array.isArray(value)) {
    for (const one of value) {
      const found = beyond(one, of, unit);
      if (found) return found;
    }
    return null;
  }
  if (typeof value !== "number") return null;
  if (of.maximum !== null && of.maximum !== undefined && value > of.maximum)
    return tr("workspaces.aboveMaximum", { maximum: withUnit(figure(of.maximum), unit) });
  if (of.minimum !== null && of.minimum !== undefined && value < of.minimum)
    return tr("workspaces.belowMinimum", { minimum: withUnit(figure(of.minimum), unit) });
  return null;
}

/** Describes the limits: "0 … 2", "at most 2", "at least 0"; empty if there are none. */
export function limitsText(of: ShownValue): string {
  const { minimum, maximum } = of;
  const [low, high] = [typeof minimum === "number" ? figure(minimum) : null, typeof maximum === "number" ? figure(maximum) : null];
  if (low !== null && high !== null) return `${low} … ${high}`;
  if (high !== null) return tr("workspaces.atMostHigh", { high });
  return low === null ? "" : tr("workspaces.atLeastLow", { low });
}
