// SPDX-License-Identifier: Apache-2.0

import type { Mode, Statistics } from "../control/shapes";
import { Refusals } from "../design/parts";
import { tr, trWord } from "../language/text";
import { useAction, useLive } from "./context";

/** The mode of the cell, and controls for pausing its program. */
export function ModeAndPause(props: { now: Statistics | null }) {
  const control = useLive();
  const action = useAction();
  const { now } = props;
  if (!now) return null;
  const paused = now.paused === true || (Array.isArray(now.paused) && now.paused.length > 0);
  const about = Array.isArray(now.paused) ? tr("shell.pausedPaused", { paused: now.paused.join(", ") }) : tr("shell.paused2");
  if (!control.may("operate")) {
    return (
      <div className="mode quiet">
        {trWord(now.mode)}
        {paused ? `, ${about}` : ""}
      </div>
    );
  }
  const orders = paused
    ? { text: tr("shell.resumeProgram"), title: about, order: () => control.order("resume_program", {}) }
    : { text: tr("shell.pauseProgram"), title: tr("shell.suspendsTheActionsOnDevices"), order: () => control.stop("pause", {}) };
  return (
    <div className="mode" data-commands>
      <label>
        <span className="quiet">{tr("shell.mode")} </span>
        <select
          aria-label={tr("shell.mode")}
          value={trWord(now.mode)}
          disabled={action.busy}
          onChange={(event) => {
            const mode = event.target.value as Mode;
            void action.run(() => control.order("set_mode", { mode }));
          }}
        >
          <option value="automatic">{tr("shell.automatic")}</option>
          <option value="manual">{tr("shell.manual")}</option>
        </select>
      </label>
      <button type="button" aria-pressed={paused} title={orders.title} disabled={action.busy} onClick={() => action.run(orders.order)}>
        {orders.text}
      </button>
      <Refusals of={action.refusals} />
    </div>
  );
}
