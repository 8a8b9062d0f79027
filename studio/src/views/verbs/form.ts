// SPDX-License-Identifier: Apache-2.0
import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import { type Refusal, RefusalError, refusalsOf } from "../../control/refusals";
import type { VerbForm } from "../../control/shapes";
import { useControl } from "../../shell/context";

/** Returns the form and the definition of a verb. */
export function useForm(name: string): { form: VerbForm | null; refusals: Refusal[] } {
  const control = useControl();
  const [form, setForm] = useState<VerbForm | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  useEffect(() => {
    return askUntilAnswered(control, {
      ask: (signal) => control.look("verb_form", { name }, signal),
      take: (found) => {
        setForm(found);
        setRefusals([]);
      },
      failed: (why) => {
        // A recording contains no forms: its diagrams are made from instances.
        if (!(why instanceof RefusalError && why.is("NotRecorded"))) setRefusals(refusalsOf(why));
      },
    });
  }, [control, name]);
  return { form, refusals };
}
