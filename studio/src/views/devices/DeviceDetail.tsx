// SPDX-License-Identifier: Apache-2.0

import type { Configuration, Statistics } from "../../control/shapes";
import { Coded, Panel, Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { Age } from "../../live/Age";
import { forcedOf } from "../../live/forced";
import { LiveValue } from "../../live/LiveValue";
import { useAction, useControl } from "../../shell/context";
import { addressOf } from "../../shell/route";
import { StateTag } from "./Family";
import { Forcing } from "./Forcing";
import { isRenewed, svvName } from "./families";
import { Parameters } from "./Parameters";
import { WriteField } from "./WriteField";

/** One logical device, with live values of all its SVVs, and its parameters. */
export function DeviceDetail(props: { name: string; configuration: Configuration; now: Statistics }) {
  const { name, configuration, now } = props;
  const control = useControl();
  const action = useAction();
  const type = configuration.device_types[configuration.logical_devices[name] ?? ""];
  const state = now.devices[name];
  if (!type) return null;
  const svvs = Object.entries(type.svvs);
  const floats = svvs.filter(([, svv]) => /double|float/.test(svv.type_text)).map(([member, svv]) => svvName(name, member, svv));
  return (
    <Panel
      className={isRenewed(state) ? "" : "old"}
      title={
        <>
          {name} <StateTag of={state} /> {!isRenewed(state) && <Age of={svvs.map(([member, svv]) => svvName(name, member, svv))} />}
        </>
      }
      end={
        <>
          {floats.length > 0 && <a href={addressOf("scope", [], { names: floats.slice(0, 4).join(",") })}>{tr("devices.showInScope")}</a>}
          {control.may("operate") && (
            <>
              <button
                type="button"
                data-commands
                disabled={action.busy || (state !== "disabled" && state !== "fault")}
                onClick={() => action.run(() => control.order("enable", { name }))}
              >
                {tr("devices.enable")}
              </button>
              <button
                type="button"
                data-commands
                disabled={action.busy || state === "disabled"}
                onClick={() => action.run(() => control.stop("disable", { name }))}
              >
                {tr("devices.disable")}
              </button>
            </>
          )}
        </>
      }
    >
      <Refusals of={action.refusals} />
      <p className="quiet">
        <Coded of={type.doc.split(/\n\s*\n/)[0] ?? ""} />{" "}
        {type.verb && (
          <a href={addressOf("verbs", [type.verb, `${name}.${type.verb}`])}>{tr("devices.updatedByVerb", { verb: type.verb })}</a>
        )}
      </p>
      <div className="detail-columns">
        <div>
          <h3>{tr("devices.sVVs")}</h3>
          <table>
            <tbody>
              {svvs.map(([member, svv]) => {
                const full = svvName(name, member, svv);
                return (
                  <tr key={member}>
                    <th scope="row">
                      <a
                        href={addressOf("scope", [], { names: full })}
                        title={tr("devices.fullTypeTextShowInScope", { full, type_text: svv.type_text })}
                      >
                        {member}
                      </a>
                      {svv.shared && <span className="quiet"> {tr("devices.sharedShared", { shared: svv.shared })}</span>}
                    </th>
                    <td className="number">
                      <LiveValue name={full} type_text={svv.type_text} unit={svv.unit} />
                    </td>
                    <td>
                      {svv.within && control.may("operate") && <WriteField name={full} type_text={svv.type_text} within={svv.within} />}
                    </td>
                  </tr>
                );
              })}
            </tbody>
          </table>
        </div>
        <Forcing device={name} type={type.name} state={state} forced={forcedOf(now)[name]} />
        {/* Parameters are of now: a recording has none. */}
        {control.past === null && <Parameters device={name} type={type} />}
      </div>
    </Panel>
  );
}
