// SPDX-License-Identifier: Apache-2.0
import { WatchedValue } from "../../control/watched";

/** A tour in progress, with the joints of its arm. */
export interface ArmTour {
  joints: readonly string[];
}

/** The tour of this page; null if none is in progress. */
export const tour = new WatchedValue<ArmTour | null>(null);
