// SPDX-License-Identifier: Apache-2.0
import { useSyncExternalStore } from "react";

/** Media query for windows so narrow that panels are stacked instead of docked. */
const NARROW = "(max-width: 700px)";

/** Returns whether the window is too narrow for panels side by side. */
export function useIsNarrow(): boolean {
  return useSyncExternalStore(
    (changed) => {
      const query = window.matchMedia(NARROW);
      query.addEventListener("change", changed);
      return () => query.removeEventListener("change", changed);
    },
    () => window.matchMedia(NARROW).matches,
  );
}
