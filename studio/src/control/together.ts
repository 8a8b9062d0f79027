// SPDX-License-Identifier: Apache-2.0
import { RefusalError, refusalsOf } from "./refusals";

/**
 * Makes a call for each device, all concurrently: one press commands all of them, and a slow call does not delay the others. If any call
 * is refused, throws a `RefusalError` with all refusals, after the other devices have executed the call.
 */
export async function forEach(devices: readonly string[], call: (device: string) => Promise<unknown>): Promise<void> {
  const ended = await Promise.allSettled(devices.map(call));
  const refusals = ended.flatMap((one) => (one.status === "rejected" ? refusalsOf(one.reason) : []));
  if (refusals.length > 0) throw new RefusalError(refusals, 0);
}
