// SPDX-License-Identifier: Apache-2.0

import { useEffect, useMemo, useState } from "react";
import { askUntilAnswered } from "../../../control/asking";
import type { Control } from "../../../control/control";
import { type Refusal, refusalsOf } from "../../../control/refusals";
import type { Composition as Asked, VerbRequest } from "../../../control/shapes";
import { Panel, Refusals } from "../../../design/parts";
import { tr } from "../../../language/text";
import { useAction, useLive } from "../../../shell/context";
import { addressOf } from "../../../shell/route";
import { type StateEdit, StatesCanvas } from "../../verbs/StatesCanvas";
import { CompositionPanel, PartPanel, StepsPanel } from "./CompositionPanel";
import * as composed from "./composed";
import type { ComposedDefinition, Part } from "./definition";
import { Head, type Working } from "./Head";
import { draftOf, withoutSources } from "./reading";
import { SystemVerb } from "./SystemVerb";

/** Time without changes after which the system is queried, ms. */
const PAUSE_MS = 250;

/** Editor of a verb composed of verbs: its parts as states, with transitions between them. */
export function CompositionEditor(props: { work: Working; draft: ComposedDefinition }) {
  const { work, draft } = props;
  const [chosen, setChosen] = useState<string | null>(null);
  const { verb, found } = useComposed(draft);
  const put = work.change;
  const shape = useMemo(() => composed.shapeOfComposition(draft), [draft]);
  const edit = useMemo(
    (): StateEdit => ({
      chosen,
      choose: setChosen,
      connect: (from, to) => put(composed.setStep(draft, draft.of.transitions.length, composed.drawnStep(draft, from, to))),
      found: (state) => found.filter((one) => one.message.includes(`part '${state}'`)).map(said),
      isWrong: () => false,
    }),
    [draft, found, chosen, put],
  );
  const label = chosen?.split(".")[0];
  return (
    <>
      <Head work={work} of={draft} put={(text) => put(composed.setComposition(draft, text))} trouble={[]} opened={() => setChosen(null)}>
        {null}
      </Head>
      <Verbs
        draft={draft}
        add={(name, part) => {
          const known = part ? { ...draft, made_of: { ...draft.made_of, [name]: part } } : draft;
          const made = composed.addPart(known, name);
          put(made.composed);
          setChosen(made.label);
        }}
      />
      <StatesCanvas shape={shape} edit={edit} />
      <div className="side stack">
        <Panel
          title={tr("flow.checks")}
          end={<span role="status">{verb ? tr("flow.allPassed") : tr("flow.countFound", { count: found.length })}</span>}
        >
          {found.length > 0 && (
            <ul className="refusals">
              {found.map((one) => (
                <li key={one.message}>{said(one)}</li>
              ))}
            </ul>
          )}
        </Panel>
        {label !== undefined && Object.hasOwn(draft.of.parts, label) && (
          <PartPanel key={label} draft={draft} label={label} change={put} choose={setChosen} />
        )}
        <StepsPanel draft={draft} change={put} />
        <CompositionPanel draft={draft} change={put} />
        <Install name={draft.of.name} verb={verb} />
      </div>
    </>
  );
}

function said(one: Refusal): string {
  return one.remedy ? `${one.message}; ${one.remedy}` : one.message;
}

/** Verbs of the file and of the system that can become parts. */
function Verbs(props: { draft: ComposedDefinition; add: (name: string, part?: Part) => void }) {
  const { draft, add } = props;
  const [wrong, setWrong] = useState<Refusal[]>([]);
  const known = Object.keys(draft.made_of).filter((name) => !isWithin(draft, name));
  return (
    <Panel title={tr("flow.verbs")} className="palette side">
      <ul>
        {known.map((name) => (
          <li key={name}>
            <button type="button" data-verb={name} onClick={() => add(name)}>
              {name}
            </button>
          </li>
        ))}
      </ul>
      {known.length === 0 && <p className="quiet">{tr("flow.openAFileWithVerbsOr")}</p>}
      <SystemVerb
        label={tr("flow.addAVerbOfTheSystem")}
        first={tr("flow.fromTheSystem")}
        without={known}
        take={(name, defined) => {
          if (Object.keys(defined.parts ?? {}).length > 0) throw new Error(tr("flow.nameIsComposedAndACopy", { name }));
          add(name, draftOf("verb", name, withoutSources(defined)) as Part);
        }}
        failed={setWrong}
      />
      <Refusals of={wrong} />
    </Panel>
  );
}

/** Returns whether a definition is the composition itself, or contains it. */
function isWithin(draft: ComposedDefinition, name: string, depth = 0): boolean {
  if (name === draft.of.name) return true;
  const part = Object.hasOwn(draft.made_of, name) ? draft.made_of[name] : undefined;
  if (part?.kind !== "composition" || depth > 20) return false;
  return Object.values(part.of.parts).some((inner) => isWithin(draft, inner, depth + 1));
}

/** Returns the verb that the system creates from the composition, or the errors. The query is repeated a moment after each change. */
function useComposed(draft: ComposedDefinition): { verb: VerbRequest | null; found: Refusal[] } {
  const control = useLive();
  const [answer, setAnswer] = useState<{ verb: VerbRequest | null; found: Refusal[] }>({ verb: null, found: [] });
  useEffect(() => {
    return askUntilAnswered(control, {
      ask: (signal) => composedVerb(control, draft, signal),
      take: (verb) => setAnswer({ verb, found: [] }),
      failed: (why) => setAnswer({ verb: null, found: refusalsOf(why) }),
      after_ms: PAUSE_MS,
    });
  }, [control, draft]);
  return answer;
}

async function composedVerb(
  control: Control,
  { of, made_of }: ComposedDefinition,
  signal: AbortSignal,
  around: string[] = [],
): Promise<VerbRequest> {
  if (around.includes(of.name)) throw new Error(tr("flow.definitionsFormACircle", { value: [...around, of.name].join(" → ") }));
  const parts = new Map<string, unknown>();
  for (const [label, name] of Object.entries(of.parts)) {
    const part = Object.hasOwn(made_of, name) ? made_of[name] : undefined;
    if (!part) throw new Error(tr("flow.partLabelOfNameIsThe", { label, name: of.name, name2: name }));
    const inner = () =>
      composedVerb(control, { kind: "composition", of: (part as Part & { kind: "composition" }).of, made_of }, signal, [
        ...around,
        of.name,
      ]);
    parts.set(label, part.kind === "verb" ? composed.verbOf(part) : await inner());
  }
  // The drawn composition is in JSON form; the system reports errors in it.
  return await control.look("compose", { ...composed.askedOf(of), parts: Object.fromEntries(parts) } as unknown as Asked, signal);
}

function Install(props: { name: string; verb: VerbRequest | null }) {
  const { name, verb } = props;
  const control = useLive();
  const { busy, refusals, run } = useAction();
  const [installed, setInstalled] = useState<VerbRequest | null>(null);
  if (!control.may("configure")) return null;
  return (
    <Panel title={tr("flow.install")}>
      <div className="row">
        <button
          type="button"
          className="primary"
          disabled={busy || verb === null}
          onClick={() =>
            void run(async () => {
              if (!verb) return;
              await control.order("define_verb", verb);
              setInstalled(verb);
            })
          }
        >
          {tr("flow.installVerbName", { name })}
        </button>
        {installed !== null && installed === verb && (
          <span role="status">
            {tr("flow.installed")} <a href={addressOf("verbs", [name])}>{tr("flow.startIt")}</a>
          </span>
        )}
      </div>
      <Refusals of={refusals} />
    </Panel>
  );
}
