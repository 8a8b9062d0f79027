// SPDX-License-Identifier: Apache-2.0
import { useState } from "react";
import type { FormInput, InstalledInstance, Value, VerbForm } from "../../control/shapes";
import { Refusals } from "../../design/parts";
import { unitText } from "../../design/units";
import { useAction, useControl } from "../../shell/context";
import { unitOf } from "../flow/installed/units";
import { valueFrom, wrongText } from "./fields";

/** The inputs of a verb that may be changed while it runs. */
export function tunables(form: VerbForm): FormInput[] {
  return form.inputs.filter((input) => input.tunable);
}

/** Changes inputs of an instance that runs; fields that are left empty stay as they are. */
export function SetForm(props: { form: VerbForm; instance: InstalledInstance }) {
  const control = useControl();
  const action = useAction();
  const inputs = tunables(props.form);
  const [texts, setTexts] = useState<Record<string, string>>({});
  const [wrong, setWrong] = useState<string | null>(null);
  return (
    <form
      className="set"
      data-commands
      onSubmit={(event) => {
        event.preventDefault();
        const values: Record<string, Value> = {};
        const found = inputs.map((input) => wrongText(texts[input.name] ?? "", input.type_text)).find((one) => one !== null);
        setWrong(found ?? null);
        if (found) return;
        for (const input of inputs) {
          const value = valueFrom(texts[input.name] ?? "", input.type_text);
          if (value !== undefined) values[input.name] = value;
        }
        void action.run(() => control.order("set", { instance: props.instance.id, values }));
      }}
    >
      {inputs.map((input) => (
        <label key={input.name} className="row">
          <span>{input.name}</span>
          <input value={texts[input.name] ?? ""} onChange={(event) => setTexts({ ...texts, [input.name]: event.target.value })} />
          <span className="quiet">
            {input.type_text}
            {input.unit ? `, ${unitText(unitOf(props.instance, input.unit))}` : ""}
          </span>
        </label>
      ))}
      <button type="submit" disabled={action.busy || Object.values(texts).every((text) => text.trim() === "")}>
        Change
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
