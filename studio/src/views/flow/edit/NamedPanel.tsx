// SPDX-License-Identifier: Apache-2.0

import { type ReactNode, useId } from "react";
import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { tr } from "../../../language/text";
import { freeName } from "./change";
import type { Draft } from "./definition";
import { about, type Finding } from "./findings";

export type VerbDraft = Draft & { kind: "verb" };

/** Named items of a verb, which can be added, renamed and removed; each shows its findings. */
export function NamedPanel<T>(props: {
  title: string;
  /** Word for an item of this kind. */
  one: string;
  /** Kind of the location in a finding, such as `condition`. */
  place: string;
  draft: VerbDraft;
  of: Record<string, T>;
  /** New item, with its name if that name is free. */
  fresh: [string, T];
  set: (draft: Draft, name: string, value: T | null) => Draft;
  /** Renames an item, including all references to it. */
  rename: (draft: VerbDraft, name: string, to: string) => Draft;
  change: (draft: Draft) => void;
  /** Suggestions for the item's fields, which refer to the suggestions by the id passed as `list`. */
  choices: string[];
  fields: (value: T, put: (value: T) => void, list: string) => ReactNode;
  found: (name: string) => Finding[];
}) {
  const { draft, of, set, change } = props;
  const list = useId();
  const [wanted, fresh] = props.fresh;
  const kind = props.one.charAt(0).toUpperCase() + props.one.slice(1);
  return (
    <Panel
      title={props.title}
      end={
        <button type="button" onClick={() => change(set(draft, freeName(wanted, Object.keys(of)), fresh))}>
          {tr("flow.add")}
        </button>
      }
    >
      {Object.keys(of).length > 0 && (
        <datalist id={list}>
          {props.choices.map((name) => (
            <option key={name} value={name} />
          ))}
        </datalist>
      )}
      {Object.entries(of).map(([name, value]) => (
        <fieldset key={name} aria-label={`${kind} ${name}`} data-place={`${props.place}:${name}`}>
          <div className="row">
            <TextField
              label={tr("flow.name")}
              value={name}
              commit={(to) => {
                if (to === "" || Object.hasOwn(of, to)) return to === "" ? tr("flow.enterAName") : tr("flow.toAlreadyExists", { to });
                change(props.rename(draft, name, to));
              }}
            />
            <button
              type="button"
              aria-label={tr("flow.removeOneName", { one: props.one, name })}
              onClick={() => change(set(draft, name, null))}
            >
              ×
            </button>
          </div>
          {props.fields(value, (next) => change(set(draft, name, next)), list)}
          <Found of={props.found(name)} />
        </fieldset>
      ))}
    </Panel>
  );
}

export function Found(props: { of: Finding[] }) {
  return props.of.map((finding) => (
    <p key={finding.message} className="small" role="alert">
      {about(finding)}
    </p>
  ));
}
