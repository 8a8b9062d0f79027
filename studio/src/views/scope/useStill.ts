// SPDX-License-Identifier: Apache-2.0
import { useEffect } from "react";
import type { Scope } from "./scope";

/** Stops the scope while the page is paused. */
export function useStill(scope: Scope, isStill: boolean): void {
  useEffect(() => {
    if (!isStill || scope.stopped.get()) return;
    scope.stop(true);
    return () => scope.stop(false);
  }, [scope, isStill]);
}
