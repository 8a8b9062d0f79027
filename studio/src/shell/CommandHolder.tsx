// SPDX-License-Identifier: Apache-2.0
import { Refusals } from "../design/parts";
import { useAction, useControl, useWatched } from "./context";

/** Who commands the system. It is taken by the first command; here it is given back, or taken from another one. */
export function CommandHolder() {
  const control = useControl();
  const holder = useWatched(control.command.holder);
  const name = useWatched(control.session.name);
  const action = useAction();
  if (!control.may("operate")) {
    return (
      <div className="holder quiet" title="The token of this page has the role 'observe': it looks, and commands nothing.">
        observing{holder ? `; ${holder} commands` : ""}
      </div>
    );
  }
  const ours = holder !== null && holder === name;
  return (
    <div className="holder">
      <span className="quiet">Commanded by</span> <strong>{ours ? "this page" : (holder ?? "nobody")}</strong>
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
