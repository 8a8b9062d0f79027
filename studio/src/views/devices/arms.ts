// SPDX-License-Identifier: Apache-2.0
import { useEffect, useState } from "react";
import type { ArmDescription } from "../../control/shapes";
import { useControl } from "../../shell/context";

/** Polling interval for the arms, ms. They are polled because a program may change the tool of an arm. */
const LOOK_MS = 1000;

/** Returns the arms of the system, as its programs currently describe them; null while they are unknown, and for a recording. */
export function useArms(): ArmDescription[] | null {
  const control = useControl();
  const [arms, setArms] = useState<ArmDescription[] | null>(null);
  useEffect(() => {
    let over = false;
    let said = "";
    let again: ReturnType<typeof setTimeout> | undefined;
    const look = () => {
      control
        .look("arms", {})
        .then((found) => {
          const now = JSON.stringify(found);
          if (!over && now !== said) setArms(found);
          said = now;
        })
        // If the system does not answer, the page reports that at its top.
        .catch(() => undefined)
        .finally(() => {
          if (!over) again = setTimeout(look, LOOK_MS);
        });
    };
    if (control.past === null) look();
    return () => {
      over = true;
      clearTimeout(again);
    };
  }, [control]);
  return arms;
}
