// SPDX-License-Identifier: Apache-2.0
// Alternative units: `rad|m` belongs to a port that serves revolute and prismatic joints alike.

import { tr } from "../language/text";
/** Splits a choice into its units; any other unit is returned as the only element. */
export function choices(unit: string): string[] {
  return unit.split("|");
}

/** Formats a unit for display. `rad|m` becomes "rad or m", because the unit depends on the joint. */
export function unitText(unit: string | null | undefined): string {
  return unit ? choices(unit).join(` ${tr("design.or")} `) : "";
}

/** Returns whether two units are compatible: they have a unit in common, or one of them is unspecified. */
export function unitsAgree(one: string, other: string): boolean {
  return !one || !other || choices(one).some((unit) => choices(other).includes(unit));
}
