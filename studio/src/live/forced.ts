// SPDX-License-Identifier: Apache-2.0
// Forced signals: values that a person has set in place of a reading or a command.

import { useSyncExternalStore } from "react";
import type { ForcedSignal, Statistics } from "../control/shapes";
import { valueText } from "../design/numbers";
import { tr } from "../language/text";
import { useControl } from "../shell/context";

/** Returns the forced signals, by their devices. A recording made by an earlier release contains none. */
export function forcedOf(now: Statistics | null): Record<string, ForcedSignal> {
  return now?.forced ?? {};
}

/** Describes a force: "forced to true by anna". */
export function forceText(of: ForcedSignal): string {
  return tr("live.forcedToByWho", { part: of.output ? tr("live.output") : tr("live.input"), value: valueText(of.value), who: of.who });
}

/**
 * Returns the description of the force of an SVV or channel; null if it is not forced. The SVV `value` of a forced output still contains
 * the value that the program commands. It is marked as well, because the machine receives a different value.
 */
export function forceOf(now: Statistics | null, name: string): string | null {
  for (const [signal, of] of Object.entries(forcedOf(now))) {
    if (name === of.channel || name === `${signal}.value`) return forceText(of);
  }
  return null;
}

/** Returns the description of the force of an SVV or channel; the component is re-rendered when the description changes. */
export function useForce(name: string): string | null {
  const { statistics } = useControl().topics;
  return useSyncExternalStore(statistics.watch, () => forceOf(statistics.get(), name));
}
