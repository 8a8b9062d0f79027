// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import type { DeviceState, ForcedSignal, Value } from "../../control/shapes";
import { valueText } from "../../design/numbers";
import { Refusals, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { forceText } from "../../live/forced";
import { useAction, useControl } from "../../shell/context";
import { valueFrom, wrongText } from "../verbs/fields";
import { isRenewed, shortName } from "./families";

/** Types of devices that can be forced, with the C types of their values: `gpac.cell`. */
const SIGNALS: Record<string, { type_text: string; output: boolean }> = {
  digital_input: { type_text: "bool", output: false },
  analog_input: { type_text: "double", output: false },
  digital_output: { type_text: "bool", output: true },
  analog_output: { type_text: "double", output: true },
};

/** Returns true if the devices of a type can be forced. */
export function isSignal(type: string): boolean {
  return type in SIGNALS;
}

/** Mark of a forced signal next to its state. */
export function ForcedTag(props: { of: ForcedSignal | undefined }) {
  if (!props.of) return null;
  return (
    <Tag tone="warn" title={forceText(props.of)}>
      {tr("devices.forced", { value: valueText(props.of.value) })}
    </Tag>
  );
}

/** Controls that force or release one input or output; empty for a device that is not a signal, and on a page without the permission. */
export function Forcing(props: { device: string; type: string; state: DeviceState | undefined; forced: ForcedSignal | undefined }) {
  const { device, forced, state } = props;
  const control = useControl();
  const action = useAction();
  const [text, setText] = useState("");
  const signal = SIGNALS[props.type];
  if (!signal || !control.may("operate") || (!control.may("configure") && !forced)) return null;
  const name = shortName(device);
  const force = (value: Value) => action.run(() => control.order("force", { name: device, value }));
  const value = valueFrom(text, signal.type_text);
  const unread = wrongText(text, signal.type_text);
  const isAble = isRenewed(state) && !action.busy;
  return (
    <section className="forcing" aria-label={tr("devices.forcingOfDevice", { device })}>
      <h3>{tr("devices.forcing")}</h3>
      <p className="quiet">
        {signal.output ? tr("devices.theMachineGetsThisValueWhatever") : tr("devices.theProgramGetsThisValueWhatever")}{" "}
        {tr("devices.theForceEndsWithThisPage")}
      </p>
      <div className="row" data-commands>
        {control.may("configure") &&
          (signal.type_text === "bool" ? (
            [false, true].map((to) => (
              <button
                key={String(to)}
                type="button"
                disabled={!isAble}
                aria-pressed={forced?.value === to}
                aria-label={tr("devices.forceName", { part: to ? tr("devices.on") : tr("devices.off"), name })}
                onClick={() => force(to)}
              >
                {tr("devices.force")} {to ? tr("devices.on") : tr("devices.off")}
              </button>
            ))
          ) : (
            <form
              className="row"
              onSubmit={(event) => {
                event.preventDefault();
                if (value !== undefined && unread === null) void force(value);
              }}
            >
              <input
                aria-label={tr("devices.valueToForceNameTo", { name })}
                aria-invalid={unread !== null}
                title={unread ?? undefined}
                size={6}
                value={text}
                onChange={(event) => setText(event.target.value)}
              />
              <button
                type="submit"
                aria-label={tr("devices.forceName2", { name })}
                disabled={!isAble || value === undefined || unread !== null}
              >
                {tr("devices.force")}
              </button>
            </form>
          ))}
        <button
          type="button"
          aria-label={tr("devices.releaseName", { name })}
          disabled={!forced || action.busy}
          onClick={() => action.run(() => control.order("unforce", { name: device }))}
        >
          {tr("devices.release")}
        </button>
      </div>
      {/* Below the buttons, so that its length moves none of them. */}
      <p className={forced ? "" : "quiet"}>
        {forced ? forceText(forced) : isRenewed(state) ? tr("devices.notForced") : tr("devices.enableItFirst")}
      </p>
      <Refusals of={action.refusals} />
    </section>
  );
}
