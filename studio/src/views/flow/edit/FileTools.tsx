// SPDX-License-Identifier: Apache-2.0

import { useId, useMemo, useState } from "react";
import { type Refusal, refusalsOf } from "../../../control/refusals";
import { Refusals } from "../../../design/parts";
import { tr } from "../../../language/text";
import { type DrawnDefinition, newComposition, newGraph, newVerb, type Part } from "./definition";
import { besides, download, draftsOf, savedFile } from "./file";
import type { OpenedFile } from "./history";
import { draftOf, withoutSources } from "./reading";
import { SystemVerb } from "./SystemVerb";

/** Returns the verbs and compositions of a file and of the draft that can become parts of a composition. */
function partsAt(draft: DrawnDefinition, found: DrawnDefinition[]): Record<string, Part> {
  const parts = found.flatMap((one): [string, Part][] => {
    if (one.kind === "graph") return [];
    return [[one.of.name, one.kind === "verb" ? one : { kind: "composition", of: one.of }]];
  });
  const own: Record<string, Part> = draft.kind === "composition" ? draft.made_of : draft.kind === "verb" ? { [draft.of.name]: draft } : {};
  return { ...Object.fromEntries(parts), ...own };
}

/** Buttons to create, open and save files, and to start from a verb of the system. */
export function FileTools(props: {
  draft: DrawnDefinition;
  file: OpenedFile | null;
  open: (draft: DrawnDefinition, file: OpenedFile | null) => void;
}) {
  const [said, setSaid] = useState<string | null>(null);
  const [wrong, setWrong] = useState<Refusal[]>([]);
  const field = useId();
  const read = async (file: File | undefined) => {
    if (!file) return;
    setWrong([]);
    try {
      const text = await file.text();
      const [first] = draftsOf(text);
      const more = besides(text);
      if (!first) throw new Error(tr("flow.nameDefinesNeitherAGraphNor", { name: file.name, part: more ?? "" }));
      setSaid(more);
      props.open(first, { name: file.name, text });
    } catch (why) {
      setWrong(refusalsOf(why));
    }
  };
  const found = useMemo(() => (props.file ? draftsOf(props.file.text) : []), [props.file]);
  /** Switches to another definition in the file. Changes to the current one are kept in the file. */
  const change = (wanted: string) => {
    if (!props.file) return;
    setWrong([]);
    try {
      const { name, text } = savedFile(props.draft, props.file);
      const chosen = draftsOf(text).find((draft) => `${draft.kind} ${draft.of.name}` === wanted);
      if (chosen) props.open(chosen, { name, text });
    } catch (why) {
      setWrong(refusalsOf(why));
    }
  };
  const save = () => {
    setWrong([]);
    try {
      const saved = savedFile(props.draft, props.file);
      download(saved.name, saved.text);
      setSaid(saved.said);
    } catch (why) {
      setWrong(refusalsOf(why));
    }
  };
  return (
    <div className="stack">
      <div className="row">
        <button type="button" onClick={() => props.open(newGraph("untitled"), null)}>
          {tr("flow.newGraph")}
        </button>
        <button type="button" onClick={() => props.open(newVerb("untitled"), null)}>
          {tr("flow.newVerb")}
        </button>
        <button
          type="button"
          title={tr("flow.aVerbComposedOfVerbsOf")}
          onClick={() => props.open(newComposition("untitled", partsAt(props.draft, found)), props.file)}
        >
          {tr("flow.newComposition")}
        </button>
        <label className="button" htmlFor={field}>
          {tr("flow.openFile")}
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
        <SystemVerb
          label={tr("flow.openAVerbOfTheSystem")}
          first={tr("flow.openFromTheSystem")}
          take={(name, defined) => props.open(draftOf("verb", name, withoutSources(defined)), null)}
          failed={setWrong}
        />
        {found.length > 1 && (
          <select
            aria-label={tr("flow.definitionOfTheFile")}
            value={`${props.draft.kind} ${props.draft.of.name}`}
            onChange={(event) => {
              change(event.target.value);
            }}
          >
            {found.map((draft) => (
              <option key={`${draft.kind} ${draft.of.name}`}>{`${draft.kind} ${draft.of.name}`}</option>
            ))}
          </select>
        )}
        <button type="button" onClick={save}>
          {tr("flow.saveFile")}
        </button>
      </div>
      {said && (
        <p className="quiet" role="status">
          {said}
        </p>
      )}
      <Refusals of={wrong} />
    </div>
  );
}
