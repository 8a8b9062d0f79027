// SPDX-License-Identifier: Apache-2.0

import { useMemo } from "react";
import type { InstalledInstance, VerbSummary } from "../../control/shapes";
import { Empty, Panel, Refusals, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { useControl } from "../../shell/context";
import { useForm } from "./form";
import { History } from "./History";
import { lastTransition, useHappened } from "./happened";
import { Instances } from "./Instances";
import { Reports } from "./Reports";
import { StartForm } from "./StartForm";
import { StatesCanvas } from "./StatesCanvas";
import { shapeOfDefinition, shapeOfInstance } from "./shape";

/** A verb: its diagram, its instances, a form that starts another instance, and the history of its instances. */
export function VerbDetail(props: { verb: VerbSummary; instances: InstalledInstance[]; chosen: string | null }) {
  const { verb, instances } = props;
  const control = useControl();
  const { form, refusals } = useForm(verb.name);
  const shown =
    instances.find((one) => one.name === props.chosen) ?? instances.find((one) => one.state === "running") ?? instances.at(-1) ?? null;
  const shape = useMemo(() => (shown ? shapeOfInstance(shown, form?.defined.parts) : shapeOfDefinition(form?.defined)), [shown, form]);
  const happened = useHappened(shown?.name ?? null);
  const last = shown && shown.state !== "created" ? lastTransition(happened) : null;
  const [first, ...more] = verb.doc.split(/\n\s*\n/);
  const runs = shown !== null && (shown.state === "running" || shown.state === "suspended");
  return (
    <>
      <div>
        <div className="row">
          <h2>{verb.name}</h2>
          {verb.supports.length > 0 && <Tag>{tr("verbs.keepsSupportsGoing", { supports: verb.supports.join(", ") })}</Tag>}
        </div>
        <p>{first}</p>
        {more.length > 0 && (
          <details>
            <summary>{tr("verbs.more")}</summary>
            {more.map((paragraph) => (
              <p key={paragraph}>{paragraph}</p>
            ))}
          </details>
        )}
      </div>
      <Refusals of={refusals} />
      <div className="verb-columns">
        <Panel
          title={shown ? tr("verbs.commandListsOfName", { name: shown.name }) : tr("verbs.commandLists")}
          end={runs && <Tag tone="accent">{tr("verbs.listRuns", { list: shown.list })}</Tag>}
        >
          {shape ? (
            <StatesCanvas shape={shape} present={runs ? shown.list : null} last={last} />
          ) : (
            <p className="quiet">{tr("verbs.waitingForItsDefinition")}</p>
          )}
        </Panel>
        <div className="stack">
          <Instances of={instances} shown={shown?.name ?? null} form={form} />
          {verb.supports.length > 0 ? (
            <Panel title={tr("verbs.start")}>
              <Empty title={tr("verbs.startedByDevices")}>{tr("verbs.itRunsWhileADeviceOf")}</Empty>
            </Panel>
          ) : !control.may("operate") ? (
            <Panel title={tr("verbs.start")}>
              <Empty title={tr("verbs.startingIsNotPossible")}>
                {control.past || control !== control.origin ? tr("verbs.theDisplayIsNotLiveReturn") : tr("verbs.thisPageMayOnlyObserveIts")}
              </Empty>
            </Panel>
          ) : (
            form && <StartForm form={form} instances={instances} />
          )}
        </div>
      </div>
      <History of={happened} instance={shown?.name ?? null} />
      <Reports verb={verb.name} />
    </>
  );
}
