// SPDX-License-Identifier: Apache-2.0
// Setups stored in this browser: the last one, and named ones.
import { checked, EMPTY, type Setup } from "./setup";

const LAST = "opengpac.scope.last";
const NAMED = "opengpac.scope.setups";

/** Returns the most recently shown setup. */
export function kept(): Setup {
  try {
    return checked(JSON.parse(localStorage.getItem(LAST) ?? "null") ?? EMPTY);
  } catch {
    // Damaged, or from an earlier version: start with the empty setup.
    return EMPTY;
  }
}

export function keepLast(setup: Setup): void {
  localStorage.setItem(LAST, JSON.stringify(setup));
}

/** Returns all named setups in alphabetical order. */
export function named(): Map<string, Setup> {
  const setups = new Map<string, Setup>();
  try {
    for (const [name, setup] of Object.entries(JSON.parse(localStorage.getItem(NAMED) ?? "{}") as object)) setups.set(name, checked(setup));
  } catch {
    return setups;
  }
  return new Map([...setups].sort(([a], [b]) => a.localeCompare(b)));
}

export function keepAs(name: string, setup: Setup): void {
  write(new Map([...named(), [name, setup]]));
}

export function forget(name: string): void {
  const setups = named();
  setups.delete(name);
  write(setups);
}

function write(setups: ReadonlyMap<string, Setup>): void {
  localStorage.setItem(NAMED, JSON.stringify(Object.fromEntries(setups)));
}
