// SPDX-License-Identifier: Apache-2.0
import { useEffect, useState } from "react";
import { type Refusal, RefusalError, refusalsOf } from "../../control/refusals";
import type { VerbForm } from "../../control/shapes";
import { useControl } from "../../shell/context";

/** Returns the form and the definition of a verb. */
export function useForm(name: string): { form: VerbForm | null; refusals: Refusal[] } {
  const control = useControl();
  const [form, setForm] = useState<VerbForm | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  useEffect(() => {
    let over = false;
    control.look("verb_form", { name }).then(
      (found) => over || setForm(found),
      // A recording contains no forms: its diagrams are made from instances.
      (why) => over || (why instanceof RefusalError && why.is("NotRecorded")) || setRefusals(refusalsOf(why)),
    );
    return () => {
      over = true;
    };
  }, [control, name]);
  return { form, refusals };
}
