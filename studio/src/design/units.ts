// SPDX-License-Identifier: Apache-2.0
// Units that are a choice: `rad|m` is that of a port which serves turning and sliding joints alike.

/** The units that a choice is made of; of any other unit itself. */
export function choices(unit: string): string[] {
  return unit.split("|");
}

/** A unit for people: `rad|m` is one or the other, as the joint is. */
export function unitText(unit: string | null | undefined): string {
  return unit ? choices(unit).join(" or ") : "";
}

/** Returns whether a value in the one unit may be one in the other; if one of them is not given, it may. */
export function unitsAgree(one: string, other: string): boolean {
  return !one || !other || choices(one).some((unit) => choices(other).includes(unit));
}
