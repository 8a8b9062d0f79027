// SPDX-License-Identifier: Apache-2.0
import { useState } from "react";
import { personOf } from "../control/command";
import type { Statistics } from "../control/shapes";
import { Refusals } from "../design/parts";
import { RequestForm } from "./CommandRequests";
import { useAction, useLive, useWatched } from "./context";

/**
 * Returns the instances that are running although no session has command: they were started by a program, or by a session that has
 * ended.
 */
export function moving(now: Statistics | null): string[] {
  return (now?.instances ?? []).filter((one) => one.state === "running" && one.owner === null).map((one) => one.name);
}

/** Returns the name of the commander: this page, a person or session, a program, or nobody. */
export function commanderOf(holder: string | null, person: string | null, own: string | null, now: Statistics | null): string {
  if (holder === null) return moving(now).length > 0 ? "a program" : "nobody";
  return holder === own ? "this page" : (person ?? holder);
}

/** Holder of command. The first command given on the page takes it; here it can be released, requested, or taken from another session. */
export function CommandHolder(props: { now: Statistics | null }) {
  const control = useLive();
  const state = useWatched(control.command.state);
  const name = useWatched(control.session.name);
  const action = useAction();
  const [asking, setAsking] = useState(false);
  const { holder } = state;
  const running = moving(props.now);
  const ours = holder !== null && holder === name;
  const waits = state.requests.some((one) => one.name === name);
  const alone = running.length > 0 ? `a program: ${running[0]}${running.length > 1 ? ` and ${running.length - 1} more` : ""}` : "nobody";
  const title =
    running.length > 0 ? `No session has command. Started by a program and running: ${running.join(", ")}` : "No session has command.";
  if (!control.may("operate")) {
    return (
      <div className="holder quiet" title="The token of this page has the role 'observe', which does not allow commands.">
        observing; {holder === null ? alone : <Named name={holder} person={state.person ?? null} />} commands
      </div>
    );
  }
  return (
    <div className="holder" data-commands title={holder === null ? title : `Session ${holder}, ${personOf(state)}`}>
      <span className="quiet">Commanded by</span>{" "}
      <strong>{ours ? "this page" : holder === null ? alone : <Named name={holder} person={state.person ?? null} />}</strong>
      {ours && (
        <button type="button" disabled={action.busy} onClick={() => action.run(() => control.command.giveBack())}>
          Give back
        </button>
      )}
      {!ours && holder !== null && !waits && (
        <button type="button" aria-expanded={asking} onClick={() => setAsking(!asking)}>
          Request command
        </button>
      )}
      {!ours && holder !== null && control.may("configure") && (
        <button type="button" disabled={action.busy} onClick={() => action.run(() => control.command.take(true))}>
          Take from {holder}
        </button>
      )}
      {asking && !ours && !waits && holder !== null && <RequestForm done={() => setAsking(false)} />}
      <Refusals of={action.refusals} />
    </div>
  );
}

/** A session's name, with the name of its person if one was entered. */
function Named(props: { name: string; person: string | null }) {
  return props.person === null ? (
    <span>{props.name}</span>
  ) : (
    <>
      <span>{props.person}</span> <span className="quiet small">{props.name}</span>
    </>
  );
}
