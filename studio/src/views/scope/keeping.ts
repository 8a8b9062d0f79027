// SPDX-License-Identifier: Apache-2.0
// Setups that this browser keeps: the last one, and those with a name.
import { checked, EMPTY, type Setup } from "./setup";

const LAST = "opengpac.scope.last";
const NAMED = "opengpac.scope.setups";

/** The setup that was looked at last. */
export function kept(): Setup {
  try {
    return checked(JSON.parse(localStorage.getItem(LAST) ?? "null") ?? EMPTY);
  } catch {
    // One of an earlier version, or broken by hand: begin anew.
    return EMPTY;
  }
}

export function keepLast(setup: Setup): void {
  localStorage.setItem(LAST, JSON.stringify(setup));
}

/** All with a name, in the order of the alphabet. */
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
