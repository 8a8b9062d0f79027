// SPDX-License-Identifier: Apache-2.0
import type { Statistics } from "../control/shapes";
import { Refusals } from "../design/parts";
import { useAction, useControl, useWatched } from "./context";

/** The emergency stop: one press, no question. It needs no command. While it is latched: its cause, and the reset. */
export function EmergencyStop(props: { now: Statistics | null }) {
  const control = useControl();
  const action = useAction();
  const name = useWatched(control.session.name);
  const cause = props.now?.emergency ?? null;
  if (!control.may("operate")) {
    return cause === null ? null : <div className="stopped">Emergency stop: {cause}</div>;
  }
  return (
    <div className="emergency">
      {cause !== null && (
        <div className="stopped" role="alert">
          <span>Emergency stop: {cause}</span>
          <button type="button" disabled={action.busy} onClick={() => action.run(() => control.order("reset", {}))}>
            Reset
          </button>
        </div>
      )}
      <button
        type="button"
        className="stop"
        aria-label="Emergency stop"
        onClick={() => action.run(() => control.emergencyStop(`pressed in the studio${name ? ` (${name})` : ""}`))}
      >
        Emergency stop
      </button>
      <Refusals of={action.refusals} />
    </div>
  );
}
