// SPDX-License-Identifier: Apache-2.0

import type { Statistics } from "../control/shapes";
import { valueText } from "../design/numbers";
import { Refusals } from "../design/parts";
import { tr } from "../language/text";
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
    <div className="notice warn forced-note" role="status" aria-label={tr("shell.forcedSignals")}>
      <strong>{tr("shell.countSignalsAreForced", { count: forced.length })}</strong>
      <span className="said">
        {forced.map(([name, of], index) => (
          <span
            key={name}
            title={tr("shell.channelByWho", { part: of.output ? tr("shell.output") : tr("shell.input"), channel: of.channel, who: of.who })}
          >
            {index > 0 && ", "}
            <a href={addressOf("devices", [name])}>{name}</a> {valueText(of.value)}
          </span>
        ))}
      </span>
      {control.may("operate") && (
        <button type="button" data-commands disabled={action.busy} onClick={() => action.run(() => control.order("unforce", {}))}>
          {tr("shell.releaseAll")}
        </button>
      )}
      <Refusals of={action.refusals} />
    </div>
  );
}
