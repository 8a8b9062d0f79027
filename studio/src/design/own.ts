// SPDX-License-Identifier: Apache-2.0

/**
 * Returns the entry of a map under a name entered by a person. Ignores properties that every object inherits, such as `constructor` and
 * `__proto__`.
 */
export function own<T>(map: Readonly<Record<string, T>> | undefined, name: string): T | undefined {
  return map !== undefined && Object.hasOwn(map, name) ? map[name] : undefined;
}
