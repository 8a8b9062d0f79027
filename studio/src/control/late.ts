// SPDX-License-Identifier: Apache-2.0
import type { PressTime, Source } from "./source";

/** The oldest command that the daemon obeys, ms. */
const AGE_MAX_MS = 500;

/**
 * Returns whether a command that was given at `pressed` is too old by now. To make an instance may take longer than that: it is kept for the next
 * press, which starts it at once.
 */
export function isLate(control: Pick<Source, "pressed">, pressed: PressTime): boolean {
  const now = control.pressed();
  return pressed !== null && now !== null && now - pressed > AGE_MAX_MS;
}
