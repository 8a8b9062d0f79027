// SPDX-License-Identifier: Apache-2.0

/**
 * Returns the entry of a map under a name entered by a person. Properties that every object inherits, `constructor` and `__proto__`, do
 * not count.
 */
export function own<T>(map: Readonly<Record<string, T>> | undefined, name: string): T | undefined {
  return map !== undefined && Object.hasOwn(map, name) ? map[name] : undefined;
}
