// SPDX-License-Identifier: Apache-2.0
import type { Reading } from "../control/shapes";

/** Returns whether a value has ever been stored; an initial value has the number 0 and the time 0. */
export function isStored(reading: Reading): boolean {
  return reading.number !== 0 || reading.time_ns !== 0;
}
