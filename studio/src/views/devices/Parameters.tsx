// SPDX-License-Identifier: Apache-2.0

import { useCallback, useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { DeviceType, Value } from "../../control/shapes";
import { valueText } from "../../design/numbers";
import { Refusals, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { useAction, useControl } from "../../shell/context";
import { valueFrom, wrongText } from "../verbs/fields";

/** The parameters of a device. A tunable parameter takes effect immediately, others when the device is next enabled. */
export function Parameters(props: { device: string; type: DeviceType }) {
  const { device, type } = props;
  const control = useControl();
  const [values, setValues] = useState<Record<string, Value>>({});
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const names = Object.keys(type.parameters);
  const asked = names.join(" ");
  const ask = useCallback(
    async (signal?: AbortSignal) => {
      const parameters = asked === "" ? [] : asked.split(" ");
      const found = await Promise.all(parameters.map((parameter) => control.look("device_parameter", { name: device, parameter }, signal)));
      return Object.fromEntries(parameters.map((parameter, index): [string, Value] => [parameter, found[index] ?? null]));
    },
    [control, device, asked],
  );
  const take = useCallback((found: Record<string, Value>) => {
    setValues(found);
    setRefusals([]);
  }, []);
  const failed = useCallback((why: unknown) => setRefusals(refusalsOf(why)), []);
  const look = () => ask().then(take, failed);
  useEffect(() => askUntilAnswered(control, { ask, take, failed }), [control, ask, take, failed]);
  if (names.length === 0) return null;
  return (
    <div>
      <h3>{tr("devices.parameters")}</h3>
      <Refusals of={refusals} />
      <table>
        <tbody>
          {Object.entries(type.parameters).map(([name, parameter]) => (
            <tr key={name}>
              <th scope="row">
                {name} {parameter.tunable && <Tag title={tr("devices.changesRunningVerbsImmediately")}>{tr("devices.tunable")}</Tag>}
              </th>
              <td className="number">
                {name in values ? valueText(values[name]) : "–"}
                {parameter.unit && <span className="quiet">{`\u202f${parameter.unit}`}</span>}
              </td>
              <td>
                {control.may("operate") && (
                  <SetParameter
                    device={device}
                    name={name}
                    isTruth={typeof parameter.default === "boolean"}
                    tunable={parameter.tunable}
                    changed={look}
                  />
                )}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function SetParameter(props: { device: string; name: string; isTruth: boolean; tunable: boolean; changed: () => Promise<void> }) {
  const control = useControl();
  const action = useAction();
  const [text, setText] = useState("");
  const value = valueFrom(text, props.isTruth ? "bool" : "double");
  const wrong = wrongText(text, props.isTruth ? "bool" : "double");
  return (
    <form
      className="write"
      data-commands
      onSubmit={(event) => {
        event.preventDefault();
        if (value === undefined || wrong !== null) return;
        void action
          .run(async () => {
            await control.order("set_device_parameter", { name: props.device, parameter: props.name, value });
            await props.changed();
          })
          .then((done) => done && setText(""));
      }}
    >
      <input
        aria-label={tr("devices.newValueOfName", { name: props.name })}
        size={7}
        value={text}
        placeholder={props.isTruth ? tr("devices.trueOrFalse") : ""}
        onChange={(event) => setText(event.target.value)}
      />
      <button
        type="submit"
        disabled={action.busy || value === undefined || wrong !== null}
        title={props.tunable ? tr("devices.immediately") : tr("devices.fromTheNextTimeItIs")}
      >
        {tr("devices.set")}
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
