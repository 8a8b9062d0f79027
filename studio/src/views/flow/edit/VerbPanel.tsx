// SPDX-License-Identifier: Apache-2.0
import { useId } from "react";
import { Panel } from "../../../design/parts";
import { constantOf, TextField } from "./BoxPanel";
import { freeName, setCondition, setInput, setList, setOutput, setTransition } from "./change";
import type { Draft } from "./definition";
import { type Faces, type Item, itemsOf } from "./faces";
import { about, type Finding, ofCondition, ofTransition } from "./findings";

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
  const { draft, change } = props;
  const reported = namesOf(props, (item) => item.kind === "condition");
  const list = useId();
  return (
    <Panel
      title="Conditions"
      end={
        <button
          type="button"
          onClick={() =>
            change(
              setCondition(draft, freeName("done", Object.keys(draft.of.conditions)), {
                on: [],
                returns: null,
                raises: false,
                during: [],
                priority: 0,
              }),
            )
          }
        >
          Add
        </button>
      }
    >
      <datalist id={list}>
        {reported.map((name) => (
          <option key={name} value={name} />
        ))}
      </datalist>
      {Object.entries(draft.of.conditions).map(([name, condition]) => (
        <fieldset key={name} aria-label={`Condition ${name}`}>
          <div className="row">
            <TextField
              label="Name"
              value={name}
              commit={(to) => {
                if (to && !(to in draft.of.conditions)) change(setCondition(setCondition(draft, name, null), to, condition));
              }}
            />
            <button type="button" aria-label={`Remove condition ${name}`} onClick={() => change(setCondition(draft, name, null))}>
              ×
            </button>
          </div>
          <TextField
            label="is"
            list={list}
            placeholder="block.condition"
            value={condition.on.join(", ")}
            commit={(text) => change(setCondition(draft, name, { ...condition, on: words(text) }))}
          />
          <TextField
            label="returns"
            placeholder="nothing"
            value={(condition.returns ?? []).join(", ")}
            commit={(text) => change(setCondition(draft, name, { ...condition, returns: text === "" ? null : words(text) }))}
          />
          <label className="row">
            <input
              type="checkbox"
              checked={condition.raises}
              onChange={(event) => change(setCondition(draft, name, { ...condition, raises: event.target.checked }))}
            />
            is an error
          </label>
          <Found of={ofCondition(props.findings, name)} />
        </fieldset>
      ))}
    </Panel>
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
  const { draft, change } = props;
  const list = useId();
  const targets = namesOf(props, (item) => item.kind === "input" || item.kind === "parameter" || item.kind === "condition");
  return (
    <Panel
      title="Input parameters"
      end={
        <button
          type="button"
          onClick={() =>
            change(
              setInput(draft, freeName("goal", Object.keys(draft.of.input_parameters)), {
                targets: [],
                default: null,
                unit: "",
                tunable: false,
              }),
            )
          }
        >
          Add
        </button>
      }
    >
      <datalist id={list}>
        {targets.map((name) => (
          <option key={name} value={name} />
        ))}
      </datalist>
      {Object.entries(draft.of.input_parameters).map(([name, input]) => (
        <fieldset key={name} aria-label={`Input parameter ${name}`}>
          <div className="row">
            <TextField
              label="Name"
              value={name}
              commit={(to) => {
                if (to && !(to in draft.of.input_parameters)) change(setInput(setInput(draft, name, null), to, input));
              }}
            />
            <button type="button" aria-label={`Remove input parameter ${name}`} onClick={() => change(setInput(draft, name, null))}>
              ×
            </button>
          </div>
          <TextField
            label="stored in"
            list={list}
            placeholder="block.port"
            value={input.targets.join(", ")}
            commit={(text) => change(setInput(draft, name, { ...input, targets: words(text) }))}
          />
          <TextField
            label="default"
            placeholder="none: must be given"
            value={input.default === null ? "" : JSON.stringify(input.default)}
            commit={(text) => {
              const { value, wrong } = constantOf(text, "value");
              if (wrong === null) change(setInput(draft, name, { ...input, default: value ?? null }));
            }}
          />
          <label className="row">
            <input
              type="checkbox"
              checked={input.tunable}
              onChange={(event) => change(setInput(draft, name, { ...input, tunable: event.target.checked }))}
            />
            may be set while it runs
          </label>
          <Found of={props.findings.filter((finding) => finding.where.some((where) => "parameter" in where && where.parameter === name))} />
        </fieldset>
      ))}
    </Panel>
  );
}

function Outputs(props: OfVerb) {
  const { draft, change } = props;
  const list = useId();
  const ports = namesOf(props, (item) => item.kind !== "state" && item.kind !== "size");
  return (
    <Panel
      title="Output values"
      end={
        <button
          type="button"
          onClick={() => change(setOutput(draft, freeName("result", Object.keys(draft.of.output_values)), ports[0] ?? "block.port"))}
        >
          Add
        </button>
      }
    >
      <datalist id={list}>
        {ports.map((name) => (
          <option key={name} value={name} />
        ))}
      </datalist>
      {Object.entries(draft.of.output_values).map(([name, port]) => (
        <fieldset key={name} aria-label={`Output value ${name}`}>
          <div className="row">
            <TextField
              label="Name"
              value={name}
              commit={(to) => {
                if (to && !(to in draft.of.output_values)) change(setOutput(setOutput(draft, name, null), to, port));
              }}
            />
            <button type="button" aria-label={`Remove output value ${name}`} onClick={() => change(setOutput(draft, name, null))}>
              ×
            </button>
          </div>
          <TextField label="read from" list={list} value={port} commit={(text) => change(setOutput(draft, name, text))} />
          <Found of={props.findings.filter((finding) => finding.where.some((where) => "output" in where && where.output === name))} />
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

function words(text: string): string[] {
  return text.split(/[\s,]+/).filter(Boolean);
}
