// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import { type Refusal, refusalsOf } from "../../../control/refusals";
import type { VerbForm } from "../../../control/shapes";
import { useLatest } from "../../../design/useLatest";
import { useLive } from "../../../shell/context";

/**
 * Selects a verb of the system and passes its definition to `take`, which may throw. `failed` receives the errors, and an empty list at
 * each new selection.
 */
export function SystemVerb(props: {
  label: string;
  /** Text shown while nothing is selected. */
  first: string;
  without?: readonly string[];
  take: (name: string, defined: VerbForm["defined"]) => void;
  failed: (why: Refusal[]) => void;
}) {
  const control = useLive();
  const [names, setNames] = useState<string[]>([]);
  const latest = useLatest(props);
  const bring = async (name: string) => {
    props.failed([]);
    try {
      const { defined } = await control.look("verb_form", { name });
      latest.current.take(name, defined);
    } catch (why) {
      latest.current.failed(refusalsOf(why));
    }
  };
  return (
    <select
      aria-label={props.label}
      value=""
      onFocus={() => {
        control.look("names", {}).then(
          (there) => setNames(there.verbs),
          (why) => props.failed(refusalsOf(why)),
        );
      }}
      onChange={(event) => void bring(event.target.value)}
    >
      <option value="">{props.first}</option>
      {names
        .filter((name) => !props.without?.includes(name))
        .map((name) => (
          <option key={name}>{name}</option>
        ))}
    </select>
  );
}
