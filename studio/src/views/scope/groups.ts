// SPDX-License-Identifier: Apache-2.0
// Groups of the list of values, the most useful first.

import type { Configuration } from "../../control/shapes";
import { tr } from "../../language/text";
export const NO_DEVICE = tr("scope.ofTheSystem");

/** Returns the title of the group of an instance's private cells. */
export function inside(instance: string): string {
  return tr("scope.insideInstance", { instance });
}

/** Returns the SVVs of the devices in the order in which their types declare them, as in Devices, and then all other names. */
export function asDeclared(
  svvs: readonly string[],
  configuration: Pick<Configuration, "logical_devices" | "device_types"> | null,
): string[] {
  const place = new Map<string, number>();
  for (const [device, type] of Object.entries(configuration?.logical_devices ?? {}))
    for (const [index, svv] of Object.keys(configuration?.device_types[type]?.svvs ?? {}).entries()) place.set(`${device}.${svv}`, index);
  const of = (name: string) => place.get(name) ?? place.size;
  return [...svvs].sort((a, b) => of(a) - of(b));
}

/**
 * Groups names. If the search text is empty, the groups are sorted by name: `devices`, then names without a group, then private cells;
 * within a group, the order is that of `names`. Otherwise, the groups are in the order of their best matches.
 */
export function grouped(
  names: readonly string[],
  groupOf: ReadonlyMap<string, string>,
  isTyped: boolean,
  devices: ReadonlySet<string>,
): { title: string; names: string[] }[] {
  const groups = new Map<string, string[]>();
  for (const name of names) {
    const title = groupOf.get(name) ?? NO_DEVICE;
    groups.set(title, [...(groups.get(title) ?? []), name]);
  }
  const made = [...groups].map(([title, of]) => ({ title, names: of }));
  if (isTyped) return made;
  const rank = (title: string) => (devices.has(title) ? 0 : title.startsWith(inside("")) ? 2 : 1);
  return made.sort((a, b) => rank(a.title) - rank(b.title) || a.title.localeCompare(b.title, undefined, { numeric: true }));
}
