// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import type { FormInput, InstalledInstance, Value, VerbForm } from "../../control/shapes";
import { Refusals } from "../../design/parts";
import { unitText } from "../../design/units";
import { tr } from "../../language/text";
import { useAction, useControl } from "../../shell/context";
import { unitOf } from "../flow/installed/units";
import { presentText, valueFrom, wrongText } from "./fields";

/** Returns the inputs of a verb that may be changed while it runs. */
export function tunables(form: VerbForm): FormInput[] {
  return form.inputs.filter((input) => input.tunable);
}

/** Form that changes inputs of a running instance. Fields follow the current values until they are edited. */
export function SetForm(props: { form: VerbForm; instance: InstalledInstance }) {
  const control = useControl();
  const action = useAction();
  const inputs = tunables(props.form);
  const [written, setWritten] = useState<Record<string, string>>({});
  const [wrong, setWrong] = useState<string | null>(null);
  const present = (input: FormInput) => presentText(props.instance.inputs[input.name]);
  const changed = inputs.filter((input) => (written[input.name] ?? "").trim() !== "" && written[input.name] !== present(input));
  return (
    <form
      className="set"
      data-commands
      onSubmit={async (event) => {
        event.preventDefault();
        const values: Record<string, Value> = {};
        const found = changed.map((input) => wrongText(written[input.name] ?? "", input.type_text)).find((one) => one !== null);
        setWrong(found ?? null);
        if (found) return;
        for (const input of changed) {
          const value = valueFrom(written[input.name] ?? "", input.type_text);
          if (value !== undefined) values[input.name] = value;
        }
        const sent = written;
        if (await action.run(() => control.order("set", { instance: props.instance.id, values })))
          // Text entered in the meantime is kept.
          setWritten((now) => Object.fromEntries(Object.entries(now).filter(([name, text]) => sent[name] !== text)));
      }}
    >
      {inputs.map((input) => (
        <label key={input.name} className="row">
          <span>{input.name}</span>
          <input
            value={written[input.name] ?? present(input)}
            onChange={(event) => setWritten({ ...written, [input.name]: event.target.value })}
          />
          <span className="quiet">
            {input.type_text}
            {input.unit ? `, ${unitText(unitOf(props.instance, input.unit))}` : ""}
            {changed.includes(input) && present(input) !== "" ? tr("verbs.nowInput", { input: present(input) }) : ""}
          </span>
        </label>
      ))}
      <button type="submit" disabled={action.busy || changed.length === 0}>
        {tr("verbs.change")}
      </button>
      {wrong && (
        <p className="wrong" role="alert">
          {wrong}
        </p>
      )}
      <Refusals of={action.refusals} />
    </form>
  );
}
