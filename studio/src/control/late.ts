// SPDX-License-Identifier: Apache-2.0
import type { PressTime, Source } from "./source";

/** Maximum age at which the daemon accepts a command, ms. */
const AGE_MAX_MS = 500;

/**
 * Returns whether a command given at `pressed` is already too old. This may happen if an instance has to be created first; the instance
 * is then kept for the next press, which starts it immediately.
 */
export function isLate(control: Pick<Source, "pressed">, pressed: PressTime): boolean {
  const now = control.pressed();
  return pressed !== null && now !== null && now - pressed > AGE_MAX_MS;
}
