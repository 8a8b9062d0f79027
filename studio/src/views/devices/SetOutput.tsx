// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import type { Refusal } from "../../control/refusals";
import type { DeviceState, Report, Value } from "../../control/shapes";
import { Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useControl } from "../../shell/context";
import { valueFrom, wrongText } from "../verbs/fields";
import { type DeviceFamily, isRenewed, shortName } from "./families";
import { useVerb } from "./useVerb";

/** Verbs that set outputs, by device type: `gpac.cell.set_output`. */
const SETS: Record<string, { verb: string; type_text: string }> = {
  digital_output: { verb: "set_digital_output", type_text: "bool" },
  analog_output: { verb: "set_analog_output", type_text: "double" },
};

/**
 * Returns the verb that sets the outputs of a family; null if they are not outputs, if the page may not operate, or if the system lacks
 * the verb.
 */
export function useSetVerb(family: DeviceFamily): string | null {
  const control = useControl();
  const verb = SETS[family.type.name]?.verb ?? null;
  const [isThere, setThere] = useState(false);
  const mayOperate = control.may("operate");
  useEffect(() => {
    if (verb === null || !mayOperate) return;
    return askUntilAnswered(control, {
      ask: (signal) => control.look("names", {}, signal),
      take: (names) => setThere(names.verbs.includes(verb)),
    });
  }, [control, verb, mayOperate]);
  return isThere && mayOperate ? verb : null;
}

/** Controls that set one output: on and off for a digital one, a value for an analog one. */
export function SetOutput(props: { device: string; type: string; state: DeviceState | undefined }) {
  const { device, state } = props;
  const running = useVerb();
  const [wrong, setWrong] = useState<Refusal[]>([]);
  const [text, setText] = useState("");
  const sets = SETS[props.type];
  if (!sets) return null;
  const set = (value: Value) => {
    running.clear();
    setWrong(
      isRenewed(state)
        ? []
        : [{ class: "NotEnabled", message: tr("devices.deviceIsNotEnabledSoNothing", { device }), remedy: tr("devices.pressEnableAll") }],
    );
    if (!isRenewed(state)) return;
    running.begin(device, { verb: sets.verb, arguments: { output: { device } }, values: { value } }, (report) =>
      setWrong(toldOfSetting(device, report)),
    );
  };
  const name = shortName(device);
  const isDigital = sets.type_text === "bool";
  const value = valueFrom(text, sets.type_text);
  const unread = wrongText(text, sets.type_text);
  return (
    <form
      className="set-output"
      data-commands
      onSubmit={(event) => {
        event.preventDefault();
        if (value !== undefined && unread === null) set(value);
      }}
    >
      {isDigital ? (
        [false, true].map((to) => (
          <button
            key={String(to)}
            type="button"
            aria-label={tr("devices.setName", { name, part: to ? tr("devices.on") : tr("devices.off") })}
            onClick={() => set(to)}
          >
            {to ? tr("devices.on2") : tr("devices.off2")}
          </button>
        ))
      ) : (
        <>
          <input
            aria-label={tr("devices.newValueOfName", { name })}
            aria-invalid={unread !== null}
            title={unread ?? undefined}
            size={6}
            value={text}
            onChange={(event) => setText(event.target.value)}
          />
          <button type="submit" aria-label={tr("devices.setName2", { name })} disabled={value === undefined || unread !== null}>
            {tr("devices.set")}
          </button>
        </>
      )}
      <Refusals of={[...running.refusals, ...wrong]} />
    </form>
  );
}

/** Returns the reason why an output was not set; an empty list if it was written. */
function toldOfSetting(device: string, report: Report): Refusal[] {
  if (report.condition === "written") return [];
  return [
    { class: report.condition, message: report.message || tr("devices.deviceWasNotSet", { device }), remedy: tr("devices.seeTheLog") },
  ];
}
