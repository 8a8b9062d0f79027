// SPDX-License-Identifier: Apache-2.0
import { useEffect } from "react";
import type { Statistics } from "../control/shapes";
import { Refusals } from "../design/parts";
import { type Action, useAction, useLive, useWatched } from "./context";

/** A press of the emergency stop, and what became of it: the message of one that failed leaves when it is no longer true. */
export function useEmergencyStop(now: Statistics | null): Action {
  const control = useLive();
  const action = useAction();
  const connection = useWatched(control.stream.connection);
  const isLatched = now !== null && now.emergency !== null;
  const { clear } = action;
  // It is latched now, or the system is heard again: to stop it, one presses again.
  useEffect(() => {
    if (isLatched || connection === "open") clear();
  }, [isLatched, connection, clear]);
  return action;
}

/** The button: one press, no question, no command. It stands at the same place in every view, state and width. */
export function EmergencyStop(props: { press: Action }) {
  const control = useLive();
  const name = useWatched(control.session.name);
  if (!control.may("operate")) return null;
  return (
    <button
      type="button"
      className="stop"
      aria-label="Emergency stop"
      onClick={() => props.press.run(() => control.emergencyStop(`pressed in the studio${name ? ` (${name})` : ""}`))}
    >
      Emergency stop
    </button>
  );
}

/** While it is latched: its cause, and the reset. A press that failed, with a way to put its message away. */
export function Stopped(props: { now: Statistics | null; press: Action }) {
  const control = useLive();
  const action = useAction();
  const cause = props.now?.emergency ?? null;
  return (
    <>
      {props.press.refusals.length > 0 && (
        <div className="notice bad">
          <strong>The emergency stop was not taken.</strong>
          <Refusals of={props.press.refusals} />
          <button type="button" onClick={props.press.clear}>
            Put away
          </button>
        </div>
      )}
      {cause !== null && (
        <div className="notice bad stopped" role="alert">
          <strong>Emergency stop:</strong> <span>{cause}</span>
          {control.may("operate") && (
            <button type="button" disabled={action.busy} onClick={() => action.run(() => control.order("reset", {}))}>
              Reset
            </button>
          )}
          <Refusals of={action.refusals} />
        </div>
      )}
    </>
  );
}
