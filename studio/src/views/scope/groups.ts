// SPDX-License-Identifier: Apache-2.0
// Groups of the list of values: what people look for first.

export const NO_DEVICE = "of the system";

/** Returns the title of the private cells of an instance. */
export function inside(instance: string): string {
  return `inside ${instance}`;
}

/**
 * Puts names into their groups. While nothing is typed: `devices`, then what belongs to none, then what blocks have inside, each by name;
 * in a group as it was given. What is typed brings the best first, with those of the same group.
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
