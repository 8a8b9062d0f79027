// SPDX-License-Identifier: Apache-2.0
import { type ReactNode, useId } from "react";
import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { freeName, setCondition, setInput, setList, setOutput, setTransition } from "./change";
import type { Draft } from "./definition";
import { type Faces, type Item, itemsOf } from "./faces";
import { about, type Finding, ofCondition, ofOutput, ofParameter, ofTransition } from "./findings";
import { constantOf, words } from "./written";

type OfVerb = { draft: Draft & { kind: "verb" }; faces: Faces; findings: Finding[]; change: (draft: Draft) => void };

/** What a verb has besides its blocks: lists, conditions, transitions, parameters, results. */
export function VerbPanel(props: OfVerb) {
  return (
    <>
      <Lists {...props} />
      <Conditions {...props} />
      <Transitions {...props} />
      <Inputs {...props} />
      <Outputs {...props} />
    </>
  );
}

function Lists(props: OfVerb) {
  const { draft, change } = props;
  return (
    <Panel
      title="Command lists"
      end={
        <button type="button" onClick={() => change(setList(draft, freeName("list", Object.keys(draft.of.command_lists)), []))}>
          Add
        </button>
      }
    >
      <p className="quiet">Choose one in the drawing “Command lists” to see its commands. Draw from one to another for a transition.</p>
    </Panel>
  );
}

function Conditions(props: OfVerb) {
  return (
    <NamedPanel
      {...props}
      title="Conditions"
      one="condition"
      of={props.draft.of.conditions}
      fresh={["done", { on: [], returns: null, raises: false, during: [], priority: 0 }]}
      set={setCondition}
      choices={namesOf(props, (item) => item.kind === "condition")}
      found={(name) => ofCondition(props.findings, name)}
      fields={(condition, put, list) => (
        <>
          <TextField
            label="is"
            list={list}
            placeholder="block.condition"
            value={condition.on.join(", ")}
            commit={(text) => put({ ...condition, on: words(text) })}
          />
          <TextField
            label="returns"
            placeholder="nothing"
            value={(condition.returns ?? []).join(", ")}
            commit={(text) => put({ ...condition, returns: text === "" ? null : words(text) })}
          />
          <label className="row">
            <input
              type="checkbox"
              checked={Boolean(condition.raises)}
              onChange={(event) => put({ ...condition, raises: event.target.checked })}
            />
            is an error{typeof condition.raises === "string" ? `: ${condition.raises}` : ""}
          </label>
        </>
      )}
    />
  );
}

function Transitions(props: OfVerb) {
  const { draft, change } = props;
  if (draft.of.transitions.length === 0) return null;
  const conditions = [...Object.keys(draft.of.conditions), "completed", "fault", "halted"];
  return (
    <Panel title="Transitions">
      {draft.of.transitions.map((line, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: a transition is known by its place
        <fieldset key={index} aria-label={`Transition from ${line.from} to ${line.to}`}>
          <div className="row">
            <span>{line.from}</span>
            <select
              aria-label="Condition"
              value={line.condition}
              onChange={(event) => change(setTransition(draft, index, { ...line, condition: event.target.value }))}
            >
              {[...new Set([line.condition, ...conditions])].map((name) => (
                <option key={name}>{name}</option>
              ))}
            </select>
            <span>→ {line.to}</span>
            <button type="button" aria-label="Remove transition" onClick={() => change(setTransition(draft, index, null))}>
              ×
            </button>
          </div>
          <Found of={ofTransition(props.findings, line.from, line.condition)} />
        </fieldset>
      ))}
    </Panel>
  );
}

function Inputs(props: OfVerb) {
  return (
    <NamedPanel
      {...props}
      title="Input parameters"
      one="input parameter"
      of={props.draft.of.input_parameters}
      fresh={["goal", { targets: [], default: null, unit: "", tunable: false }]}
      set={setInput}
      choices={namesOf(props, (item) => item.kind === "input" || item.kind === "parameter" || item.kind === "condition")}
      found={(name) => ofParameter(props.findings, name)}
      fields={(input, put, list) => (
        <>
          <TextField
            label="stored in"
            list={list}
            placeholder="block.port"
            value={input.targets.join(", ")}
            commit={(text) => put({ ...input, targets: words(text) })}
          />
          <TextField
            label="default"
            placeholder="none: must be given"
            value={input.default === null ? "" : JSON.stringify(input.default)}
            commit={(text) => {
              const { value, wrong } = constantOf(text, "value");
              if (wrong !== null) return wrong;
              put({ ...input, default: value ?? null });
            }}
          />
          <label className="row">
            <input type="checkbox" checked={input.tunable} onChange={(event) => put({ ...input, tunable: event.target.checked })} />
            may be set while it runs
          </label>
        </>
      )}
    />
  );
}

function Outputs(props: OfVerb) {
  const ports = namesOf(props, (item) => item.kind !== "state" && item.kind !== "size");
  return (
    <NamedPanel
      {...props}
      title="Output values"
      one="output value"
      of={props.draft.of.output_values}
      fresh={["result", ports[0] ?? "block.port"]}
      set={setOutput}
      choices={ports}
      found={(name) => ofOutput(props.findings, name)}
      fields={(port, put, list) => <TextField label="read from" list={list} value={port} commit={put} />}
    />
  );
}

/** What a verb has several of, each with a name: added, renamed, removed; what is wrong stands at each. */
function NamedPanel<T>(props: {
  title: string;
  /** What one of them is called. */
  one: string;
  draft: Draft;
  of: Record<string, T>;
  /** One that is added: the name it gets where that is free. */
  fresh: [string, T];
  set: (draft: Draft, name: string, value: T | null) => Draft;
  change: (draft: Draft) => void;
  /** What its fields propose, under the id that they are given as `list`. */
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
          Add
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
        <fieldset key={name} aria-label={`${kind} ${name}`}>
          <div className="row">
            <TextField
              label="Name"
              value={name}
              commit={(to) => {
                if (to === "" || to in of) return to === "" ? "a name is needed" : `there is a '${to}' already`;
                change(set(set(draft, name, null), to, value));
              }}
            />
            <button type="button" aria-label={`Remove ${props.one} ${name}`} onClick={() => change(set(draft, name, null))}>
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

function Found(props: { of: Finding[] }) {
  return props.of.map((finding) => (
    <p key={finding.message} className="small" role="alert">
      {about(finding)}
    </p>
  ));
}

function namesOf(props: OfVerb, wanted: (item: Item) => boolean): string[] {
  const blocks = Object.entries(props.draft.of.blocks);
  return blocks.flatMap(([label, use]) =>
    itemsOf(use, props.faces)
      .filter(wanted)
      .map((item) => `${label}.${item.name}`),
  );
}
