// SPDX-License-Identifier: Apache-2.0
import type { Mode, Statistics } from "../control/shapes";
import { Refusals } from "../design/parts";
import { useAction, useLive } from "./context";

/** The mode of the cell, and controls for pausing its program. */
export function ModeAndPause(props: { now: Statistics | null }) {
  const control = useLive();
  const action = useAction();
  const { now } = props;
  if (!now) return null;
  const paused = now.paused === true || (Array.isArray(now.paused) && now.paused.length > 0);
  const about = Array.isArray(now.paused) ? `paused: ${now.paused.join(", ")}` : "paused";
  if (!control.may("operate")) {
    return (
      <div className="mode quiet">
        {now.mode}
        {paused ? `, ${about}` : ""}
      </div>
    );
  }
  const orders = paused
    ? { text: "Resume program", title: about, order: () => control.order("resume_program", {}) }
    : { text: "Pause program", title: "suspends the actions on devices", order: () => control.stop("pause", {}) };
  return (
    <div className="mode" data-commands>
      <label>
        <span className="quiet">Mode </span>
        <select
          aria-label="Mode"
          value={now.mode}
          disabled={action.busy}
          onChange={(event) => {
            const mode = event.target.value as Mode;
            void action.run(() => control.order("set_mode", { mode }));
          }}
        >
          <option value="automatic">automatic</option>
          <option value="manual">manual</option>
        </select>
      </label>
      <button type="button" aria-pressed={paused} title={orders.title} disabled={action.busy} onClick={() => action.run(orders.order)}>
        {orders.text}
      </button>
      <Refusals of={action.refusals} />
    </div>
  );
}
