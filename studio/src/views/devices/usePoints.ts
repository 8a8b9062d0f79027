// SPDX-License-Identifier: Apache-2.0
import { useCallback, useEffect, useRef, useState } from "react";
import { type Refusal, RefusalError } from "../../control/refusals";
import type { TaughtPoints } from "../../control/shapes";
import { useControl } from "../../shell/context";

/** Interval at which the file is reread, ms, because programs and people also change it. */
const LOOK_MS = 2000;

export interface PointsOfArm {
  points: TaughtPoints | null;
  /** Reasons why the file cannot be read. */
  trouble: Refusal[];
  look: () => Promise<void>;
}

/** Returns the taught points of an arm, as currently stored in its file. */
export function usePoints(arm: string): PointsOfArm {
  const control = useControl();
  const [points, setPoints] = useState<TaughtPoints | null>(null);
  const [trouble, setTrouble] = useState<Refusal[]>([]);
  const said = useRef("");
  const look = useCallback(async () => {
    try {
      const found = await control.look("points", { arm });
      const now = JSON.stringify(found);
      if (now !== said.current) setPoints(found);
      said.current = now;
      setTrouble((before) => (before.length > 0 ? [] : before));
    } catch (why) {
      // If the system does not answer, the page reports that at its top.
      if (!(why instanceof RefusalError) || why.status === 0) return;
      const now = JSON.stringify(why.refusals);
      if (now !== said.current) setTrouble(why.refusals);
      said.current = now;
    }
  }, [control, arm]);
  useEffect(() => {
    let again: ReturnType<typeof setTimeout> | undefined;
    let over = false;
    const follow = () =>
      void look().finally(() => {
        if (!over) again = setTimeout(follow, LOOK_MS);
      });
    follow();
    return () => {
      over = true;
      clearTimeout(again);
    };
  }, [look]);
  return { points, trouble, look };
}
