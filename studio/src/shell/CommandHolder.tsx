// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import { personOf } from "../control/command";
import type { Statistics } from "../control/shapes";
import { Refusals } from "../design/parts";
import { tr } from "../language/text";
import { RequestForm } from "./CommandRequests";
import { useAction, useLive, useWatched } from "./context";

/**
 * Returns the instances that are running although no session has command: they were started by a program, or by a session that has
 * ended.
 */
export function moving(now: Statistics | null): string[] {
  return (now?.instances ?? []).filter((one) => one.state === "running" && one.owner === null).map((one) => one.name);
}

/** Returns the name of the commander: this page, a person or session, a program, or no one. */
export function commanderOf(holder: string | null, person: string | null, own: string | null, now: Statistics | null): string {
  if (holder === null) return moving(now).length > 0 ? tr("shell.aProgram") : tr("shell.nobody2");
  return holder === own ? tr("shell.thisPage") : (person ?? holder);
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
  const alone =
    running.length > 0
      ? tr("shell.aProgramRunning", {
          running: running[0],
          part: running.length > 1 ? ` ${tr("shell.andCountMore", { count: running.length - 1 })}` : "",
        })
      : tr("shell.nobody2");
  const title =
    running.length > 0 ? tr("shell.noSessionHasCommandStartedBy", { running: running.join(", ") }) : tr("shell.noSessionHasCommand");
  if (!control.may("operate")) {
    return (
      <div className="holder quiet" title={tr("shell.theTokenOfThisPageHas")}>
        {tr("shell.observing")} {holder === null ? alone : <Named name={holder} person={state.person ?? null} />} {tr("shell.commands")}
      </div>
    );
  }
  return (
    <div
      className="holder"
      data-commands
      title={holder === null ? title : tr("shell.sessionHolderState", { holder, state: personOf(state) })}
    >
      <span className="quiet">{tr("shell.commandedBy")}</span>{" "}
      <strong>{ours ? tr("shell.thisPage") : holder === null ? alone : <Named name={holder} person={state.person ?? null} />}</strong>
      {ours && (
        <button type="button" disabled={action.busy} onClick={() => action.run(() => control.command.giveBack())}>
          {tr("shell.giveBack")}
        </button>
      )}
      {!ours && holder !== null && !waits && (
        <button type="button" aria-expanded={asking} onClick={() => setAsking(!asking)}>
          {tr("shell.requestCommand")}
        </button>
      )}
      {!ours && holder !== null && control.may("configure") && (
        <button type="button" disabled={action.busy} onClick={() => action.run(() => control.command.take(true))}>
          {tr("shell.takeFromHolder", { holder })}
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
