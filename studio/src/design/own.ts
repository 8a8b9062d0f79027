// SPDX-License-Identifier: Apache-2.0

/** Returns the value of a map under a name that a person gave; what every object inherits, `constructor` and `__proto__`, is not of the map. */
export function own<T>(map: Readonly<Record<string, T>> | undefined, name: string): T | undefined {
  return map !== undefined && Object.hasOwn(map, name) ? map[name] : undefined;
}
