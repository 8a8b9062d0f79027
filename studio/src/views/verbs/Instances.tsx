// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import type { InstalledInstance, VerbForm } from "../../control/shapes";
import { Panel, Refusals, Tag } from "../../design/parts";
import { tr, trWord } from "../../language/text";
import { useAction, useControl } from "../../shell/context";
import { addressOf } from "../../shell/route";
import { SetForm, tunables } from "./SetForm";
import { stateTone } from "./stateTone";

/** The instances of a verb, each with the actions that are currently possible. */
export function Instances(props: { of: InstalledInstance[]; shown: string | null; form: VerbForm | null }) {
  return (
    <Panel title={tr("verbs.instances")}>
      {props.of.length === 0 ? (
        <p className="quiet">{tr("verbs.noInstancesStartOneWithThe")}</p>
      ) : (
        <ul className="instances">
          {props.of.map((instance) => (
            <Instance key={instance.id} of={instance} shown={instance.name === props.shown} form={props.form} />
          ))}
        </ul>
      )}
    </Panel>
  );
}

function Instance(props: { of: InstalledInstance; shown: boolean; form: VerbForm | null }) {
  const { of, form } = props;
  const control = useControl();
  const action = useAction();
  const [setting, setSetting] = useState(false);
  const running = of.state === "running";
  const live = running || of.state === "suspended";
  const owned = of.owner !== null;
  const names = form ? tunables(form) : [];
  return (
    <li>
      <div className="row">
        <a href={addressOf("verbs", [of.verb, of.name])} aria-current={props.shown ? "true" : undefined}>
          {of.name}
        </a>
        <Tag tone={stateTone(of.state)}>{trWord(of.state)}</Tag>
        <span className="quiet">
          {live && of.list !== "" ? `${tr("verbs.listList", { list: of.list })} ` : ""}
          {tr("verbs.countStarts", { count: of.starts })}
        </span>
        {control.may("operate") && !owned && (
          <span className="row buttons" data-commands>
            {running && (
              <button type="button" disabled={action.busy} onClick={() => action.run(() => control.stop("suspend", { instance: of.id }))}>
                {tr("verbs.suspend")}
              </button>
            )}
            {of.state === "suspended" && (
              <button type="button" disabled={action.busy} onClick={() => action.run(() => control.order("resume", { instance: of.id }))}>
                {tr("verbs.resume")}
              </button>
            )}
            {live && (
              <button type="button" disabled={action.busy} onClick={() => action.run(() => control.stop("halt", { instance: of.id }))}>
                {tr("verbs.halt")}
              </button>
            )}
            {running && names.length > 0 && (
              <button type="button" aria-expanded={setting} onClick={() => setSetting(!setting)}>
                {tr("verbs.changeInputs")}
              </button>
            )}
            {(of.state === "ended" || of.state === "created") && (
              <button type="button" disabled={action.busy} onClick={() => action.run(() => control.order("delete", { instance: of.id }))}>
                {tr("verbs.delete")}
              </button>
            )}
          </span>
        )}
        {owned && <span className="quiet">{tr("verbs.keptByOwner", { owner: of.owner })}</span>}
      </div>
      <Refusals of={action.refusals} />
      {setting && running && form && <SetForm form={form} instance={of} />}
    </li>
  );
}
