// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { Past } from "../../control/source";
import { Choice } from "../../design/Choice";
import { Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useAction, useControl, useWatched } from "../../shell/context";
import { BEGINNING, momentsOf, nearest, shared } from "./beside";
import type { Scope } from "./scope";

/** Selects another recording to be shown behind this one, and the moment at which the two are aligned. */
export function BesideTools(props: { scope: Scope; past: Past }) {
  const { scope, past } = props;
  const beside = useWatched(scope.beside);
  const action = useAction();
  const [names, setNames] = useState<string[]>([]);
  const control = useControl();
  const [unlisted, setUnlisted] = useState<Refusal[]>([]);
  useEffect(() => {
    return askUntilAnswered(control, {
      ask: () => past.others(),
      take: (found) => {
        setNames(found);
        setUnlisted([]);
      },
      failed: (why) => setUnlisted(refusalsOf(why)),
    });
  }, [control, past]);
  const choose = (name: string) =>
    action.run(async () => scope.lay(name === "" ? null : { past: await past.beside(name), moment: BEGINNING, here: 0, there: 0 }));
  return (
    <>
      <Choice
        label={tr("scope.beside")}
        value={beside?.past.name ?? ""}
        title={tr("scope.showsAnotherRecordingBehindThisOne")}
        put={(name) => void choose(name)}
      >
        <option value="">{tr("scope.nothing")}</option>
        {names.map((name) => (
          <option key={name}>{name}</option>
        ))}
      </Choice>
      {beside && <Moment scope={scope} past={past} />}
      {action.busy && <span className="quiet">{tr("scope.opens")}</span>}
      <Refusals of={[...unlisted, ...action.refusals]} />
    </>
  );
}

/** Selects a moment that occurs in both recordings, and its occurrence in each. */
function Moment(props: { scope: Scope; past: Past }) {
  const { scope, past } = props;
  const beside = useWatched(scope.beside);
  if (!beside) return null;
  const [here, there] = [momentsOf(past), momentsOf(beside.past)];
  const [times, others] = [here.get(beside.moment) ?? [], there.get(beside.moment) ?? []];
  return (
    <>
      <Choice
        label={tr("scope.alignedAt")}
        value={beside.moment}
        title={tr("scope.alignsBothRunsAtThisEvent")}
        put={(moment) => scope.lay({ ...beside, moment, here: nearest(here.get(moment) ?? [], past.cursor.get()), there: 0 })}
      >
        {shared(here, there).map((name) => (
          <option key={name}>{name}</option>
        ))}
      </Choice>
      {times.length > 1 && (
        <Which label={tr("scope.here")} of={times.length} value={beside.here} put={(at) => scope.lay({ ...beside, here: at })} />
      )}
      {others.length > 1 && (
        <Which label={tr("scope.there")} of={others.length} value={beside.there} put={(at) => scope.lay({ ...beside, there: at })} />
      )}
    </>
  );
}

function Which(props: { label: string; of: number; value: number; put: (at: number) => void }) {
  return (
    <Choice label={props.label} value={String(props.value)} put={(at) => props.put(Number(at))}>
      {Array.from({ length: props.of }, (_, at) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: the number is what it is
        <option key={at} value={at}>
          {tr("scope.atOfOf", { at: at + 1, of: props.of })}
        </option>
      ))}
    </Choice>
  );
}
