// SPDX-License-Identifier: Apache-2.0
import { useId, useState } from "react";
import { type Refusal, refusalsOf } from "../../../control/refusals";
import { Refusals } from "../../../design/parts";
import { useControl } from "../../../shell/context";
import { type Draft, draftOf, newGraph, newVerb } from "./definition";
import { download, draftsOf, fileText } from "./file";

/** New, open, save; and a verb that is in the system, to begin with. */
export function FileTools(props: { draft: Draft; open: (draft: Draft) => void }) {
  const control = useControl();
  const [found, setFound] = useState<Draft[]>([]);
  const [verbs, setVerbs] = useState<string[] | null>(null);
  const [wrong, setWrong] = useState<Refusal[]>([]);
  const field = useId();
  const read = async (file: File | undefined) => {
    if (!file) return;
    setWrong([]);
    try {
      const drafts = draftsOf(await file.text());
      const [first] = drafts;
      if (!first) throw new Error(`'${file.name}' defines no graph and no verb`);
      setFound(drafts);
      props.open(first);
    } catch (why) {
      setWrong(refusalsOf(why));
    }
  };
  const openVerb = async (name: string) => {
    setWrong([]);
    try {
      const { defined } = await control.look("verb_form", { name });
      props.open(draftOf("verb", name, defined));
    } catch (why) {
      setWrong(refusalsOf(why));
    }
  };
  return (
    <div className="stack">
      <div className="row">
        <button type="button" onClick={() => props.open(newGraph("untitled"))}>
          New graph
        </button>
        <button type="button" onClick={() => props.open(newVerb("untitled"))}>
          New verb
        </button>
        <label className="button" htmlFor={field}>
          Open file…
        </label>
        <input
          id={field}
          className="unseen"
          type="file"
          accept=".json,.toml,application/json,application/toml"
          onChange={(event) => {
            void read(event.target.files?.[0]);
            event.target.value = "";
          }}
        />
        <select
          aria-label="Open a verb of the system"
          value=""
          onFocus={() => {
            control.look("names", {}).then(
              (names) => setVerbs(names.verbs),
              (why) => setWrong(refusalsOf(why)),
            );
          }}
          onChange={(event) => void openVerb(event.target.value)}
        >
          <option value="">Open from the system…</option>
          {(verbs ?? []).map((name) => (
            <option key={name}>{name}</option>
          ))}
        </select>
        {found.length > 1 && (
          <select
            aria-label="Definition of the file"
            value={`${props.draft.kind} ${props.draft.of.name}`}
            onChange={(event) => {
              const chosen = found.find((draft) => `${draft.kind} ${draft.of.name}` === event.target.value);
              if (chosen) props.open(chosen);
            }}
          >
            {found.map((draft) => (
              <option key={`${draft.kind} ${draft.of.name}`}>{`${draft.kind} ${draft.of.name}`}</option>
            ))}
          </select>
        )}
        <button type="button" onClick={() => download(`${props.draft.of.name}.json`, fileText(props.draft))}>
          Save file
        </button>
      </div>
      <Refusals of={wrong} />
    </div>
  );
}
