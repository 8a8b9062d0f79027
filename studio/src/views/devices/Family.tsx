// SPDX-License-Identifier: Apache-2.0

import type { DeviceState, Statistics } from "../../control/shapes";
import { forEach } from "../../control/together";
import { Panel, Refusals, Tag, type Tone } from "../../design/parts";
import { tr, trWord } from "../../language/text";
import { Age } from "../../live/Age";
import { forcedOf } from "../../live/forced";
import { LiveValue } from "../../live/LiveValue";
import { useAction, useControl } from "../../shell/context";
import { addressOf } from "../../shell/route";
import { ForcedTag, isSignal } from "./Forcing";
import { columnsOf, type DeviceFamily, isRenewed, shortName, svvName } from "./families";
import { JogButtons, JogTools, useJog } from "./Jog";
import { SetOutput, useSetVerb } from "./SetOutput";

const TONES: Record<string, Tone> = { standstill: "good", moving: "accent", enabling: "warn", stopping: "warn", fault: "bad" };

export function StateTag(props: { of: DeviceState | undefined }) {
  return <Tag tone={TONES[props.of ?? ""] ?? "plain"}>{props.of ? trWord(props.of) : "–"}</Tag>;
}

/** Table of the devices of one family: state, first SVVs, enabling, jogging. */
export function Family(props: { of: DeviceFamily; now: Statistics; chosen: string | null }) {
  const { of, now } = props;
  const control = useControl();
  const action = useAction();
  const jog = useJog(of);
  const sets = useSetVerb(of) !== null;
  const forces = isSignal(of.type.name) && control.may("configure");
  const columns = columnsOf(of.type);
  const states = of.devices.map((device) => now.devices[device]);
  const enable = (devices: string[]) => {
    const pressed = control.pressed();
    return forEach(devices, (name) => control.order("enable", { name }, undefined, pressed));
  };
  const disable = (devices: string[]) => forEach(devices, (name) => control.stop("disable", { name }));
  const operates = control.may("operate");
  return (
    <Panel
      title={of.name}
      end={
        operates && (
          <>
            <button
              type="button"
              data-commands
              disabled={action.busy || states.every((state) => state === "standstill" || state === "moving")}
              onClick={() =>
                action.run(() => enable(of.devices.filter((_, index) => states[index] === "disabled" || states[index] === "fault")))
              }
            >
              {tr("devices.enableAll")}
            </button>
            <button
              type="button"
              data-commands
              disabled={action.busy || states.every((state) => state === "disabled")}
              onClick={() => action.run(() => disable(of.devices.filter((_, index) => states[index] !== "disabled")))}
            >
              {tr("devices.disableAll")}
            </button>
          </>
        )
      }
      flush
    >
      <Refusals of={[...action.refusals, ...jog.refusals]} />
      <div className="scroll-x" role="group" aria-label={tr("devices.devicesOfName", { name: of.name })} tabIndex={0}>
        <table className="family">
          <thead>
            <tr>
              <th scope="col">{of.type.name}</th>
              {jog.able && <th scope="col">{tr("devices.jog")}</th>}
              {sets && <th scope="col">{tr("devices.set")}</th>}
              {forces && <th scope="col">{tr("devices.force")}</th>}
              <th scope="col">{tr("devices.state")}</th>
              {columns.map(([name, svv]) => (
                <th key={name} scope="col" className="number">
                  {name}
                  {svv.unit && <span className="unit">{svv.unit}</span>}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {of.devices.map((device, index) => (
              <tr key={device} className={`${device === props.chosen ? "chosen" : ""} ${isRenewed(states[index]) ? "" : "old"}`}>
                <th scope="row">
                  <a href={addressOf("devices", [device])} aria-current={device === props.chosen ? "true" : undefined}>
                    {shortName(device)}
                  </a>
                </th>
                {jog.able && (
                  <td>
                    <JogButtons of={jog} device={device} />
                  </td>
                )}
                {sets && (
                  <td>
                    <SetOutput device={device} type={of.type.name} state={states[index]} />
                  </td>
                )}
                {forces && (
                  <td>
                    <a href={addressOf("devices", [device])} aria-label={tr("devices.forceDevice", { device: shortName(device) })}>
                      {tr("devices.force2")}
                    </a>
                  </td>
                )}
                <td className="state">
                  <StateTag of={states[index]} /> <ForcedTag of={forcedOf(now)[device]} />
                  {!isRenewed(states[index]) && (
                    <>
                      {" "}
                      <Age of={columns.map(([name, svv]) => svvName(device, name, svv))} />
                    </>
                  )}
                </td>
                {columns.map(([name, svv]) => (
                  <td key={name} className="number">
                    <LiveValue
                      name={svvName(device, name, svv)}
                      type_text={svv.type_text}
                      initial={isRenewed(states[index]) ? "grey" : "none"}
                    />
                  </td>
                ))}
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {operates && <JogTools of={jog} />}
    </Panel>
  );
}
