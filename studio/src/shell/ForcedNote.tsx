// SPDX-License-Identifier: Apache-2.0
import type { Statistics } from "../control/shapes";
import { valueText } from "../design/numbers";
import { Refusals } from "../design/parts";
import { forcedOf } from "../live/forced";
import { useAction, useLive } from "./context";
import { addressOf } from "./route";

/** The forced signals of the running system, in every view, with one button that releases all of them. */
export function ForcedNote(props: { now: Statistics | null }) {
  const control = useLive();
  const action = useAction();
  const forced = Object.entries(forcedOf(props.now));
  if (forced.length === 0) return null;
  return (
    <div className="notice warn forced-note" role="status" aria-label="Forced signals">
      <strong>{forced.length === 1 ? "1 signal is forced" : `${forced.length} signals are forced`}</strong>
      <span className="said">
        {forced.map(([name, of], index) => (
          <span key={name} title={`${of.output ? "output" : "input"} ${of.channel}, by ${of.who}`}>
            {index > 0 && ", "}
            <a href={addressOf("devices", [name])}>{name}</a> {valueText(of.value)}
          </span>
        ))}
      </span>
      {control.may("operate") && (
        <button type="button" data-commands disabled={action.busy} onClick={() => action.run(() => control.order("unforce", {}))}>
          Release all
        </button>
      )}
      <Refusals of={action.refusals} />
    </div>
  );
}
