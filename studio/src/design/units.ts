// SPDX-License-Identifier: Apache-2.0
// Alternative units: `rad|m` belongs to a port that serves revolute and prismatic joints alike.

/** Returns the units of a choice; for any other unit, the unit alone. */
export function choices(unit: string): string[] {
  return unit.split("|");
}

/** Formats a unit for people: `rad|m` becomes "rad or m", which depends on the joint. */
export function unitText(unit: string | null | undefined): string {
  return unit ? choices(unit).join(" or ") : "";
}

/** Returns whether two units are compatible: they share a choice, or one of them is not given. */
export function unitsAgree(one: string, other: string): boolean {
  return !one || !other || choices(one).some((unit) => choices(other).includes(unit));
}
