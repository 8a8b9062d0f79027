// SPDX-License-Identifier: Apache-2.0
import { useCallback, useEffect, useRef, useState } from "react";
import { isLate } from "../../control/late";
import { type Refusal, RefusalError, refusalsOf } from "../../control/refusals";
import type { ArmDescription, Report, TaughtPoints } from "../../control/shapes";
import type { Source } from "../../control/source";
import { useControl } from "../../shell/context";

/** Period at which the file is read again, ms: programs and people change it too. */
const LOOK_MS = 2000;
/** Period at which a motion is looked at, ms. */
const MOTION_MS = 150;

export interface PointsOfArm {
  points: TaughtPoints | null;
  /** Reasons why the file cannot be read. */
  trouble: Refusal[];
  look: () => Promise<void>;
}

/** The taught points of an arm, as its file has them now. */
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
      // Where the system does not answer, the page says so at its top.
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

/** A motion that the page has begun. */
export interface MotionUnderWay {
  /** Name of its point. */
  to: string;
  instance: number;
}

export interface Motions {
  under: MotionUnderWay | null;
  refusals: Refusal[];
  /** Begins a motion; `told` is given its report. */
  begin: (to: string, asked: { verb: string; values: Record<string, unknown> }, told: (report: Report) => void) => void;
  stop: () => void;
  clear: () => void;
}

/** Motions of an arm, one at a time. */
export function useMotions(arm: ArmDescription): Motions {
  const control = useControl();
  const [under, setUnder] = useState<MotionUnderWay | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const isBusy = useRef(false);
  const kept = useRef<KeptInstance | null>(null);
  const begin: Motions["begin"] = (to, asked, told) => {
    if (isBusy.current) return;
    isBusy.current = true;
    setRefusals([]);
    move(control, arm.joints, asked, kept, (instance) => setUnder({ to, instance }))
      .then(told, (why) => setRefusals(refusalsOf(why)))
      .finally(() => {
        isBusy.current = false;
        setUnder(null);
      });
  };
  const stop = () => {
    if (under) control.stop("halt", { instance: under.instance }).catch((why) => setRefusals(refusalsOf(why)));
  };
  return { under, refusals, begin, stop, clear: () => setRefusals([]) };
}

interface KeptInstance {
  verb: string;
  instance: number;
}

/** Makes an instance, starts it, waits for its end and removes it. An instance whose start came too late is kept for the next press. */
async function move(
  control: Source,
  devices: string[],
  asked: { verb: string; values: Record<string, unknown> },
  kept: { current: KeptInstance | null },
  begun: (instance: number) => void,
): Promise<Report> {
  const pressed = control.pressed();
  const { verb } = asked;
  const before = kept.current;
  kept.current = null;
  if (before && before.verb !== verb) await control.order("delete", { instance: before.instance });
  const isThere = before?.verb === verb;
  const instance = isThere ? before.instance : await control.order("create", { verb, arguments: { arm: { devices } } }, undefined, pressed);
  try {
    await control.order("start", { instance, values: asked.values as never }, undefined, pressed);
  } catch (why) {
    if (isLate(control, pressed)) kept.current = { verb, instance };
    else if (why instanceof RefusalError) await control.order("delete", { instance });
    throw why;
  }
  begun(instance);
  for (;;) {
    const report = await control.look("report", { instance });
    if (report) {
      await control.order("delete", { instance });
      return report;
    }
    await new Promise((passed) => setTimeout(passed, MOTION_MS));
  }
}
