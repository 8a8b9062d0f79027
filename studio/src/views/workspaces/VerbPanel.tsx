// SPDX-License-Identifier: Apache-2.0

import { useMemo } from "react";
import { Refusals, Tag } from "../../design/parts";
import { tr, trWord } from "../../language/text";
import { useControl, useTopic } from "../../shell/context";
import { addressOf } from "../../shell/route";
import { useForm } from "../verbs/form";
import { lastTransition, useHappened } from "../verbs/happened";
import { StatesCanvas } from "../verbs/StatesCanvas";
import { shapeOfDefinition, shapeOfInstance } from "../verbs/shape";
import { stateTone } from "../verbs/stateTone";
import { Lead } from "./Lead";
import "../verbs/verbs.css";

/** A verb with the state diagram of its running instance, or else of its latest instance. */
export function VerbPanel(props: { verb: string }) {
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const instances = (installed?.instances ?? []).filter((one) => one.verb === props.verb);
  const shown = instances.find((one) => one.state === "running") ?? instances.at(-1) ?? null;
  const { form, refusals } = useForm(props.verb);
  const shape = useMemo(() => (shown ? shapeOfInstance(shown, form?.defined.parts) : shapeOfDefinition(form?.defined)), [shown, form]);
  const happened = useHappened(shown?.name ?? null);
  const runs = shown !== null && (shown.state === "running" || shown.state === "suspended");
  return (
    <>
      <p className="row">
        {shown ? (
          <>
            <Lead to={addressOf("verbs", [props.verb, shown.name])}>{shown.name}</Lead>{" "}
            <Tag tone={stateTone(shown.state)}>{trWord(shown.state)}</Tag>
            {runs && shown.list && <span className="quiet">{tr("workspaces.listList", { list: shown.list })}</span>}
          </>
        ) : (
          <span className="quiet">{tr("workspaces.noInstance")}</span>
        )}
      </p>
      <Refusals of={refusals} />
      {shape && (
        <StatesCanvas
          shape={shape}
          present={runs ? shown.list : null}
          last={shown && shown.state !== "created" ? lastTransition(happened) : null}
        />
      )}
    </>
  );
}
