// SPDX-License-Identifier: Apache-2.0

import type { Button } from "../../control/shapes";
import { Refusals, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { useAction, useControl, useTopic } from "../../shell/context";
import { instanceNameOf, start, stateOf } from "./starting";

/** Buttons that start and halt verbs, each with its state. */
export function ButtonsPanel(props: { of: readonly Button[]; workspace: string }) {
  return (
    <ul className="verb-buttons">
      {props.of.map((button) => (
        <VerbButton key={button.label} of={button} workspace={props.workspace} />
      ))}
    </ul>
  );
}

function VerbButton(props: { of: Button; workspace: string }) {
  const { of, workspace } = props;
  const control = useControl();
  const action = useAction();
  const installed = useTopic(control.topics.installed);
  const ends = useTopic(control.topics.ends);
  const name = instanceNameOf(of, workspace);
  const instance = installed?.instances.find((one) => one.name === name) ?? null;
  const state = stateOf(of, instance, ends?.entries ?? []);
  const may = control.may("operate");
  // Nothing starts while the emergency stop is latched.
  const isLatched = (useTopic(control.topics.statistics)?.emergency ?? null) !== null;
  return (
    <li data-button={of.label} data-commands>
      <button
        type="button"
        className="primary start"
        disabled={!may || action.busy || isLatched || state.isLive || state.isMissing}
        onClick={() => action.run(() => start(control, of, workspace, instance))}
      >
        {of.label}
      </button>
      <button
        type="button"
        className="halt"
        aria-label={tr("workspaces.haltLabel", { label: of.label })}
        disabled={!may || !state.isLive || instance === null}
        onClick={() => instance && action.run(() => control.stop("halt", { instance: instance.id }))}
      >
        {tr("workspaces.halt")}
      </button>
      {isLatched ? <Tag tone="bad">{tr("workspaces.emergencyStop")}</Tag> : <Tag tone={state.tone}>{state.text}</Tag>}
      <Refusals of={action.refusals} />
    </li>
  );
}
