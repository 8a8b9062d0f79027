// SPDX-License-Identifier: Apache-2.0
import { useMemo } from "react";
import type { InstalledInstance, VerbSummary } from "../../control/shapes";
import { Empty, Panel, Refusals, Tag } from "../../design/parts";
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
          {verb.supports.length > 0 && <Tag>keeps {verb.supports.join(", ")} going</Tag>}
        </div>
        <p>{first}</p>
        {more.length > 0 && (
          <details>
            <summary>More</summary>
            {more.map((paragraph) => (
              <p key={paragraph}>{paragraph}</p>
            ))}
          </details>
        )}
      </div>
      <Refusals of={refusals} />
      <div className="verb-columns">
        <Panel title={shown ? `Command lists of ${shown.name}` : "Command lists"} end={runs && <Tag tone="accent">{shown.list} runs</Tag>}>
          {shape ? (
            <StatesCanvas shape={shape} present={runs ? shown.list : null} last={last} />
          ) : (
            <p className="quiet">Waiting for its definition…</p>
          )}
        </Panel>
        <div className="stack">
          <Instances of={instances} shown={shown?.name ?? null} form={form} />
          {verb.supports.length > 0 ? (
            <Panel title="Start">
              <Empty title="Started by devices">It runs while a device of its type is enabled; see Devices.</Empty>
            </Panel>
          ) : !control.may("operate") ? (
            <Panel title="Start">
              <Empty title="Starting is not possible">
                {control.past || control !== control.origin
                  ? "The display is not live: return to Live."
                  : "This page may only observe: its token has the role 'observe', but starting requires 'operate'."}
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
