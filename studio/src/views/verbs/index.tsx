// SPDX-License-Identifier: Apache-2.0

import { useEffect, useMemo, useRef, useState } from "react";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { VerbSummary } from "../../control/shapes";
import { Empty, Refusals } from "../../design/parts";
import { trNodes } from "../../language/nodes";
import { tr } from "../../language/text";
import { useControl, useTopic, useWatched } from "../../shell/context";
import { useRoute } from "../../shell/route";
import { VerbDetail } from "./VerbDetail";
import { VerbList } from "./VerbList";
import "./verbs.css";

/**
 * Verbs view: shows verbs and their instances with definitions, running lists and history; starts, suspends, resumes and halts
 * instances.
 */
export default function Verbs() {
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const trouble = useWatched(control.topics.installed.trouble);
  const { verbs, refusals } = useVerbs();
  const { path } = useRoute();
  const first = useRef<string | null>(null);
  const instances = useMemo(() => installed?.instances ?? [], [installed]);
  if (verbs === null || installed === null) {
    return refusals.length > 0 ? <Refusals of={refusals} /> : <p className="quiet wait">{tr("verbs.waitingForTheVerbs")}</p>;
  }
  // Without a selection: the newest running verb that does not support a device.
  const running = instances.filter((one) => one.owner === null && one.state === "running").at(-1);
  // The verb shown first stays: the start of another verb must not replace a form that is being filled in.
  first.current ??= running?.verb ?? verbs.find((verb) => verb.supports.length === 0)?.name ?? verbs[0]?.name ?? null;
  const chosen = path[0] ?? first.current;
  const verb = verbs.find((one) => one.name === chosen);
  return (
    <div className="verbs">
      <VerbList verbs={verbs} instances={instances} chosen={chosen ?? null} />
      <div className="stack">
        <Refusals of={[...trouble, ...refusals]} />
        {verb ? (
          <VerbDetail key={verb.name} verb={verb} instances={instances.filter((one) => one.verb === verb.name)} chosen={path[1] ?? null} />
        ) : verbs.length === 0 ? (
          <Empty title={tr("verbs.noVerbsDefinedYet")}>
            {trNodes("verbs.aProgramDefinesVerbsWhenIt", { code: <code>gpac.motion.move_absolute(arm, goal)</code> })}
          </Empty>
        ) : (
          <Empty title={tr("verbs.verbChosenDoesNotExist", { chosen })}>{tr("verbs.chooseOneFromTheList")}</Empty>
        )}
      </div>
    </div>
  );
}

/** Returns the defined verbs; they are read again after each installation. */
function useVerbs(): { verbs: VerbSummary[] | null; refusals: Refusal[] } {
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const [verbs, setVerbs] = useState<VerbSummary[] | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const of = installed?.instances.map((one) => one.verb).join(" ");
  // biome-ignore lint/correctness/useExhaustiveDependencies: `of` says when to ask again
  useEffect(() => {
    let over = false;
    const look = () => {
      control.look("verbs", {}).then(
        (found) => {
          if (over) return;
          setVerbs(found);
          setRefusals([]);
        },
        (why) => over || setRefusals(refusalsOf(why)),
      );
    };
    look();
    // The definition of a verb without instances is not reported.
    const again = setInterval(look, 2000);
    return () => {
      over = true;
      clearInterval(again);
    };
  }, [control, of]);
  return { verbs, refusals };
}
