// SPDX-License-Identifier: Apache-2.0
import { useEffect } from "react";
import { useLive } from "./context";

/**
 * Asks for confirmation before a page with running instances closes. Closing the page cuts off its programming system: the instances
 * that it has started are halted, unless their verbs specify otherwise.
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
