// SPDX-License-Identifier: Apache-2.0
import { useRef, useState } from "react";
import { isLate } from "../../control/late";
import { type Refusal, RefusalError, refusalsOf } from "../../control/refusals";
import type { Argument, Report, Value } from "../../control/shapes";
import type { Source } from "../../control/source";
import { useControl } from "../../shell/context";

/** Interval at which a running verb is checked, ms. */
const LOOK_MS = 150;

/** A verb requested by a press. */
export interface AskedVerb {
  verb: string;
  arguments: Record<string, Argument>;
  values: Record<string, Value>;
}

/** A verb that the page has started. */
export interface VerbUnderWay {
  /** Subject of the press: the point to be approached, or the output. */
  about: string;
  instance: number;
}

export interface VerbRunner {
  under: VerbUnderWay | null;
  refusals: Refusal[];
  /** Starts a verb, unless one is in progress; `told` is called with its report. */
  begin: (about: string, asked: AskedVerb, told: (report: Report) => void) => void;
  stop: () => void;
  clear: () => void;
}

/** Runs verbs of the system, one at a time, each from the press to its end. */
export function useVerb(): VerbRunner {
  const control = useControl();
  const [under, setUnder] = useState<VerbUnderWay | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const isBusy = useRef(false);
  const kept = useRef<KeptInstance | null>(null);
  const begin: VerbRunner["begin"] = (about, asked, told) => {
    if (isBusy.current) return;
    isBusy.current = true;
    setRefusals([]);
    runVerb(control, asked, kept, (instance) => setUnder({ about, instance }))
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
  application: string;
  instance: number;
}

/** Creates an instance, starts it, waits for its end and deletes it. An instance whose start was too late is kept for the next press. */
async function runVerb(
  control: Source,
  asked: AskedVerb,
  kept: { current: KeptInstance | null },
  begun: (instance: number) => void,
): Promise<Report> {
  const pressed = control.pressed();
  const { values, ...made } = asked;
  const application = JSON.stringify(made);
  const before = kept.current;
  kept.current = null;
  if (before && before.application !== application) await control.order("delete", { instance: before.instance });
  const isThere = before?.application === application;
  const instance = isThere ? before.instance : await control.order("create", made, undefined, pressed);
  try {
    await control.order("start", { instance, values }, undefined, pressed);
  } catch (why) {
    if (isLate(control, pressed)) kept.current = { application, instance };
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
    await new Promise((passed) => setTimeout(passed, LOOK_MS));
  }
}
