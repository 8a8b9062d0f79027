// SPDX-License-Identifier: Apache-2.0
import { useEffect } from "react";
import { useLive } from "./context";

let isReloading = false;

/** Loads the page again without asking: the reloaded page continues its session, so everything that it has started keeps running. */
export function reload(): void {
  isReloading = true;
  window.location.reload();
}

/**
 * Asks for confirmation before a page with running instances closes. Closing the page cuts off its programming system: the instances
 * that it has started are halted, unless their verbs specify otherwise.
 */
export function useCutOffWarning(): void {
  const control = useLive();
  useEffect(() => {
    const ask = (event: BeforeUnloadEvent) => {
      if (!isReloading && control.started.running(control.topics.statistics.get())) event.preventDefault();
    };
    window.addEventListener("beforeunload", ask);
    return () => window.removeEventListener("beforeunload", ask);
  }, [control]);
}
