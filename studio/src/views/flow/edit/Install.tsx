// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../../control/asking";
import type { VerbRequest } from "../../../control/shapes";
import { Panel, Refusals } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { tr } from "../../../language/text";
import { useAction, useLive } from "../../../shell/context";
import { addressOf } from "../../../shell/route";
import { type Draft, definitionOf } from "./definition";
import type { Faces } from "./faces";
import { type Placement, patternsOf } from "./placement";
import { begin, end, keepTrial, keptTrial, type Trial, type TrialRequest } from "./trial";
import { constantOf, everyOf } from "./written";

/** Installs the draft in the running system. The system refuses a change that would affect a running verb, and names that verb. */
export function Install(props: { draft: Draft; placement: Placement; faces: Faces; isSound: boolean }) {
  const { draft, placement, isSound } = props;
  const control = useLive();
  if (!control.may("configure")) return null;
  return (
    <Panel title={tr("flow.install")}>
      {!isSound && <p className="quiet">{tr("flow.fixTheFindingsUnderChecksFirst")}</p>}
      {draft.kind === "verb" ? (
        <InstallVerb draft={draft} placement={placement} isSound={isSound} />
      ) : (
        <TryGraph draft={draft} placement={placement} faces={props.faces} isSound={isSound} />
      )}
    </Panel>
  );
}

function InstallVerb(props: { draft: Draft & { kind: "verb" }; placement: Placement; isSound: boolean }) {
  const control = useLive();
  const { busy, refusals, run } = useAction();
  const [installed, setInstalled] = useState<Draft | null>(null);
  const name = props.draft.of.name;
  return (
    <div className="stack">
      <div className="row">
        <button
          type="button"
          className="primary"
          disabled={busy || !props.isSound}
          onClick={() =>
            void run(async () => {
              // The drawn definition is in JSON form; the system reports errors in it.
              await control.order("define_verb", definitionOf(props.draft) as unknown as VerbRequest);
              const patterns = patternsOf(props.draft, props.placement);
              if (Object.keys(patterns).length > 0) await control.order("place", patterns);
              setInstalled(props.draft);
            })
          }
        >
          {tr("flow.installVerbName", { name })}
        </button>
        {installed === props.draft && (
          <span role="status">
            {tr("flow.installed")} <a href={addressOf("verbs", [name])}>{tr("flow.startIt")}</a>
          </span>
        )}
      </div>
      <Refusals of={refusals} />
    </div>
  );
}

function TryGraph(props: { draft: Draft & { kind: "graph" }; placement: Placement; faces: Faces; isSound: boolean }) {
  const { draft, placement, faces } = props;
  const control = useLive();
  const { busy, refusals, run } = useAction();
  const { sources, svvs } = useThere();
  const [wanted, setWanted] = useState<TrialRequest>({ every_ns: 20_000_000, source: "", placement: {}, inputs: {} });
  const [trial, show] = useState<Trial | null>(() => keptTrial(control));
  const setTrial = (next: Trial | null) => {
    keepTrial(control, next);
    show(next);
  };
  const source = wanted.source || sources[0] || "";
  const inputs = Object.keys(draft.of.inputs);
  const missing = inputs.filter((name) => wanted.inputs[name] === undefined);
  return (
    <div className="stack">
      <p className="quiet">{tr("flow.aGraphRunsInASeparate")}</p>
      <TextField
        label={tr("flow.every")}
        value={`${wanted.every_ns / 1e6} ms`}
        commit={(text) => {
          const read = everyOf(text);
          if (read.wrong !== undefined || read.value === null) return read.wrong ?? tr("flow.enterAnIntervalForExample20");
          setWanted({ ...wanted, every_ns: read.value });
        }}
      />
      <label className="row">
        <span className="quiet">{tr("flow.on")}</span>
        <select aria-label={tr("flow.source")} value={source} onChange={(event) => setWanted({ ...wanted, source: event.target.value })}>
          {sources.map((one) => (
            <option key={one}>{one}</option>
          ))}
        </select>
      </label>
      {inputs.map((name) => (
        <InputField
          key={name}
          name={name}
          svvs={svvs}
          put={(given) => setWanted({ ...wanted, inputs: { ...wanted.inputs, [name]: given } })}
        />
      ))}
      {missing.length > 0 && <p className="quiet">{tr("flow.inputsWithoutAnSVVOrValue", { missing: missing.join(", ") })}</p>}
      <div className="row">
        <button
          type="button"
          className="primary"
          disabled={busy || !props.isSound || missing.length > 0 || source === "" || trial !== null}
          onClick={() => void run(async () => setTrial(await begin(control, draft, faces, { ...wanted, source, placement })))}
        >
          {tr("flow.installAndStart")}
        </button>
        {trial && (
          <>
            <a href={addressOf("scope", [], { names: trial.outputs.join(",") })}>{tr("flow.showItsOutputsInTheScope")}</a>
            <button
              type="button"
              disabled={busy}
              onClick={() =>
                void run(async () => {
                  await end(control, trial);
                  setTrial(null);
                })
              }
            >
              {tr("flow.haltAndRemoveVerb", { verb: trial.verb })}
            </button>
          </>
        )}
      </div>
      <Refusals of={refusals} />
    </div>
  );
}

function InputField(props: { name: string; svvs: string[]; put: (given: TrialRequest["inputs"][string]) => void }) {
  const { name, svvs, put } = props;
  const [text, setText] = useState("");
  const list = `svvs-${name}`;
  return (
    <>
      <datalist id={list}>
        {svvs.map((svv) => (
          <option key={svv} value={svv} />
        ))}
      </datalist>
      <TextField
        label={name}
        list={list}
        placeholder={tr("flow.sVVOrValue")}
        value={text}
        commit={(given) => {
          const { value, wrong } = constantOf(given, "value");
          if (svvs.includes(given)) {
            setText(given);
            put({ svv: given });
          } else if (wrong === null && value !== undefined) {
            setText(given);
            put({ value });
          } else return tr("flow.givenIsNeitherAnSVVOf", { given });
        }}
      />
    </>
  );
}

/** Returns the interrupt sources and SVVs that exist in the system. */
function useThere(): { sources: string[]; svvs: string[] } {
  const control = useLive();
  const [there, setThere] = useState<{ sources: string[]; svvs: string[] }>({ sources: [], svvs: [] });
  useEffect(() => {
    // The stream reports a system that does not answer; the form stays empty until then.
    return askUntilAnswered(control, {
      ask: (signal) => control.look("names", {}, signal),
      take: (names) => setThere({ sources: names.sources, svvs: names.svvs }),
    });
  }, [control]);
  return there;
}
