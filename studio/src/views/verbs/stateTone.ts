// SPDX-License-Identifier: Apache-2.0
import type { Tone } from "../../design/parts";

const TONES: Record<string, Tone> = { running: "good", suspended: "warn", queued: "warn", ending: "warn", fault: "bad" };

/** Returns the colour of a state of a verb instance. */
export function stateTone(state: string): Tone {
  return TONES[state] ?? "plain";
}
