// SPDX-License-Identifier: Apache-2.0
import { useEffect } from "react";
import { useLive } from "./context";

/**
 * Asks for confirmation before a page with running instances closes. A closed page is a programming system that is cut off: the
 * instances that it has started are halted, unless their verbs say otherwise.
 */
export function useCutOffWarning(): void {
  const control = useLive();
  useEffect(() => {
    const ask = (event: BeforeUnloadEvent) => {
      if (control.started.running(control.topics.statistics.get())) event.preventDefault();
    };
    window.addEventListener("beforeunload", ask);
    return () => window.removeEventListener("beforeunload", ask);
  }, [control]);
}
