// SPDX-License-Identifier: Apache-2.0
import type { InstalledInstance } from "../../../control/shapes";
import { choices } from "../../../design/units";

/**
 * Returns an instance whose ports have the units of its devices: for a servo of a prismatic joint, m and N where its blocks declare
 * `rad|m` and `N.m|N`. The choice follows from the ports that are bound to cells with a single unit; if they disagree, the units remain
 * as declared.
 */
export function inOwnUnits(instance: InstalledInstance): InstalledInstance {
  const found = choiceOf(instance);
  if (found === null) return instance;
  const own = (unit: string) => of(unit, found);
  return {
    ...instance,
    blocks: instance.blocks.map((block) => ({ ...block, ports: block.ports.map((port) => ({ ...port, unit: own(port.unit) })) })),
    cells: instance.cells.map((cell) => ({ ...cell, unit: own(cell.unit) })),
  };
}

/** Returns the unit that this instance uses in place of a unit of the verb. */
export function unitOf(instance: InstalledInstance, unit: string): string {
  return of(unit, choiceOf(instance) ?? -1);
}

function of(unit: string, choice: number): string {
  const offered = choices(unit);
  return offered.length > 1 ? (offered[choice] ?? unit) : unit;
}

function choiceOf(instance: InstalledInstance): number | null {
  const units = new Map(instance.cells.map((cell) => [cell.name, cell.unit]));
  const votes = new Set<number>();
  for (const port of instance.blocks.flatMap((block) => block.ports)) {
    const offered = choices(port.unit);
    const unit = units.get(port.cell ?? "");
    if (offered.length < 2 || !unit) continue;
    const vote = offered.indexOf(unit);
    if (vote >= 0) votes.add(vote);
  }
  const [first] = votes;
  return votes.size === 1 && first !== undefined ? first : null;
}
