// SPDX-License-Identifier: Apache-2.0
import { useEffect, useMemo, useState } from "react";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { VerbForm } from "../../control/shapes";
import { Refusals, Tag } from "../../design/parts";
import { useControl, useTopic } from "../../shell/context";
import { addressOf } from "../../shell/route";
import { lastTransition, useHappened } from "../verbs/happened";
import { StateDiagram } from "../verbs/StateDiagram";
import { shapeOfDefinition, shapeOfInstance } from "../verbs/shape";
import { stateTone } from "../verbs/stateTone";
import { Lead } from "./Lead";
import "../verbs/verbs.css";

/** A verb with its state diagram: of the instance that runs, or else of the newest. */
export function VerbPanel(props: { verb: string }) {
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const instances = (installed?.instances ?? []).filter((one) => one.verb === props.verb);
  const shown = instances.find((one) => one.state === "running") ?? instances.at(-1) ?? null;
  const { form, refusals } = useVerb(props.verb, shown === null);
  const shape = useMemo(() => (shown ? shapeOfInstance(shown) : shapeOfDefinition(form?.defined)), [shown, form]);
  const happened = useHappened(shown?.name ?? null);
  const runs = shown !== null && (shown.state === "running" || shown.state === "suspended");
  return (
    <>
      <p className="row">
        {shown ? (
          <>
            <Lead to={addressOf("verbs", [props.verb, shown.name])}>{shown.name}</Lead>{" "}
            <Tag tone={stateTone(shown.state)}>{shown.state}</Tag>
            {runs && shown.list && <span className="quiet">list {shown.list}</span>}
          </>
        ) : (
          <span className="quiet">no instance</span>
        )}
      </p>
      <Refusals of={refusals} />
      {shape && (
        <StateDiagram
          shape={shape}
          present={runs ? shown.list : null}
          last={shown && shown.state !== "created" ? lastTransition(happened) : null}
        />
      )}
    </>
  );
}

/** The definition of a verb, where no instance shows it. */
function useVerb(name: string, wanted: boolean): { form: VerbForm | null; refusals: Refusal[] } {
  const control = useControl();
  const [form, setForm] = useState<VerbForm | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  useEffect(() => {
    let over = false;
    setRefusals([]);
    if (!wanted) return;
    control.look("verb_form", { name }).then(
      (found) => over || setForm(found),
      (why) => over || setRefusals(refusalsOf(why)),
    );
    return () => {
      over = true;
    };
  }, [control, name, wanted]);
  return { form, refusals };
}
