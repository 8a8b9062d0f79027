// SPDX-License-Identifier: Apache-2.0
import type { Statistics } from "../control/shapes";
import { Refusals } from "../design/parts";
import { useAction, useLive, useWatched } from "./context";

/** What runs although no session commands: started by the program that the system is part of, or by a session that has left. */
export function moving(now: Statistics | null): string[] {
  return (now?.instances ?? []).filter((one) => one.state === "running" && one.owner === null).map((one) => one.name);
}

/** Who commands the system. It is taken by the first command; here it is given back, or taken from another one. */
export function CommandHolder(props: { now: Statistics | null }) {
  const control = useLive();
  const holder = useWatched(control.command.holder);
  const name = useWatched(control.session.name);
  const action = useAction();
  const running = moving(props.now);
  const ours = holder !== null && holder === name;
  const alone = running.length > 0 ? `a program: ${running[0]}${running.length > 1 ? ` and ${running.length - 1} more` : ""}` : "nobody";
  const title =
    running.length > 0 ? `No session commands. What runs was started by a program: ${running.join(", ")}` : "No session commands.";
  if (!control.may("operate")) {
    return (
      <div className="holder quiet" title="The token of this page has the role 'observe': it looks, and commands nothing.">
        observing; {holder ?? alone} commands
      </div>
    );
  }
  return (
    <div className="holder" title={holder === null ? title : undefined}>
      <span className="quiet">Commanded by</span> <strong>{ours ? "this page" : (holder ?? alone)}</strong>
      {ours && (
        <button type="button" disabled={action.busy} onClick={() => action.run(() => control.command.giveBack())}>
          Give back
        </button>
      )}
      {!ours && holder !== null && control.may("configure") && (
        <button type="button" disabled={action.busy} onClick={() => action.run(() => control.command.take(true))}>
          Take from {holder}
        </button>
      )}
      <Refusals of={action.refusals} />
    </div>
  );
}
