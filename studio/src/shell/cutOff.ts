// SPDX-License-Identifier: Apache-2.0
import { useEffect } from "react";
import { useLive } from "./context";

/** A page that closes is a programming system that is cut off: what it has started is halted, unless its verb says otherwise. Asks first. */
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
