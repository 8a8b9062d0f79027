// SPDX-License-Identifier: Apache-2.0

import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { tr } from "../../../language/text";
import { freeName, setCondition, setInput, setList, setObject, setOutput, setRequirement, setTransition } from "./change";
import type { Draft, Transition } from "./definition";
import { type Faces, type Item, itemsOf } from "./faces";
import { type Finding, ofCondition, ofObject, ofOutput, ofParameter, ofTransition } from "./findings";
import { Found, NamedPanel, type VerbDraft } from "./NamedPanel";
import { renameCondition, renameInput, renameObject, renameOutput, renameRequirement } from "./rename";
import { WholePanel } from "./WholePanel";
import { constantText, givenOf, withinOf, words } from "./written";

type OfVerb = { draft: VerbDraft; faces: Faces; device_types: string[]; findings: Finding[]; change: (draft: Draft) => void };

/** Text for a condition that is a normal end but returns no output values. */
const NONE = "nothing";

/** Members of a verb other than its blocks: lists, conditions, transitions, parameters, results. */
export function VerbPanel(props: OfVerb) {
  return (
    <>
      <Objects {...props} />
      <Lists {...props} />
      <Conditions {...props} />
      <Transitions {...props} />
      <Inputs {...props} />
      <Requirements {...props} />
      <Outputs {...props} />
      <WholePanel draft={props.draft} change={props.change} />
    </>
  );
}

function Objects(props: OfVerb) {
  return (
    <NamedPanel
      {...props}
      title={tr("flow.objects")}
      one={tr("flow.object")}
      place="object"
      of={props.draft.of.objects ?? {}}
      fresh={["joint", { device_type: props.device_types[0] ?? "", each: false }]}
      set={setObject}
      rename={renameObject}
      choices={props.device_types}
      found={(name) => ofObject(props.findings, name)}
      fields={(object, put, list) => (
        <>
          <TextField
            label={tr("flow.type")}
            list={list}
            placeholder={tr("flow.typeOfLogicalDevices")}
            value={object.device_type}
            commit={(device_type) => put({ ...object, device_type })}
          />
          <label className="row">
            <input type="checkbox" checked={object.each} onChange={(event) => put({ ...object, each: event.target.checked })} />
            {tr("flow.severalOfThem")}
          </label>
        </>
      )}
    />
  );
}

function Lists(props: OfVerb) {
  const { draft, change } = props;
  return (
    <Panel
      title={tr("flow.commandLists")}
      end={
        <button type="button" onClick={() => change(setList(draft, freeName("list", Object.keys(draft.of.command_lists)), []))}>
          {tr("flow.add")}
        </button>
      }
    >
      <p className="quiet">{tr("flow.selectAListInTheDrawing")}</p>
    </Panel>
  );
}

function Conditions(props: OfVerb) {
  return (
    <NamedPanel
      {...props}
      title={tr("flow.conditions")}
      one={tr("flow.condition2")}
      place="condition"
      of={props.draft.of.conditions}
      fresh={["done", { on: [], returns: null, raises: false, during: [], priority: 0 }]}
      set={setCondition}
      rename={renameCondition}
      choices={namesOf(props, (item) => item.kind === "condition")}
      found={(name) => ofCondition(props.findings, name)}
      fields={(condition, put, list) => (
        <>
          <TextField
            label={tr("flow.is")}
            list={list}
            placeholder="block.condition"
            value={condition.on.join(", ")}
            commit={(text) => put({ ...condition, on: words(text) })}
          />
          <TextField
            label={tr("flow.returns")}
            placeholder={tr("flow.emptyAbnormalEndElseNothingOr")}
            value={condition.returns?.length === 0 ? NONE : (condition.returns ?? []).join(", ")}
            commit={(text) => put({ ...condition, returns: text === "" ? null : text === NONE ? [] : words(text) })}
          />
          <TextField
            label={tr("flow.during")}
            placeholder={tr("flow.everyCommandList")}
            value={condition.during.join(", ")}
            commit={(text) => put({ ...condition, during: words(text) })}
          />
          <TextField
            label={tr("flow.priority")}
            value={String(condition.priority)}
            commit={(text) => {
              if (!/^-?\d+$/.test(text)) return tr("flow.textIsNotAPriorityWrite", { text });
              put({ ...condition, priority: Number(text) });
            }}
          />
          <div className="row">
            <label className="row">
              <input
                type="checkbox"
                checked={Boolean(condition.raises)}
                onChange={(event) => put({ ...condition, raises: event.target.checked })}
              />
              {tr("flow.isAnError")}
            </label>
            {Boolean(condition.raises) && (
              <TextField
                label={tr("flow.class")}
                placeholder="gpac.Terminated"
                value={typeof condition.raises === "string" ? condition.raises : ""}
                commit={(text) => put({ ...condition, raises: text === "" ? true : text })}
              />
            )}
          </div>
          <TextField
            label={tr("flow.alarm")}
            placeholder={tr("flow.none")}
            value={condition.alarm ?? ""}
            commit={(text) => put({ ...condition, alarm: text === "" ? null : text })}
          />
        </>
      )}
    />
  );
}

function Transitions(props: OfVerb) {
  const { draft, change } = props;
  const { transitions } = draft.of;
  const conditions = [...Object.keys(draft.of.conditions), "completed", "fault", "halted"];
  const lists = Object.keys(draft.of.command_lists);
  const [first, second = first] = lists;
  const fresh = first !== undefined && second !== undefined && { from: first, condition: conditions[0] ?? "completed", to: second };
  return (
    <Panel
      title={tr("flow.transitions")}
      end={
        <button type="button" disabled={!fresh} onClick={() => fresh && change(setTransition(draft, transitions.length, fresh))}>
          {tr("flow.add")}
        </button>
      }
    >
      {transitions.map((line, index) => {
        const choice = (label: string, key: keyof Transition, of: string[]) => (
          <select
            aria-label={label}
            value={line[key]}
            onChange={(event) => change(setTransition(draft, index, { ...line, [key]: event.target.value }))}
          >
            {[...new Set([line[key], ...of])].map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        );
        return (
          <fieldset
            // biome-ignore lint/suspicious/noArrayIndexKey: a transition is known by its place
            key={index}
            aria-label={tr("flow.transitionFromFromToTo", { from: line.from, to: line.to })}
            data-place={`transition:${line.from}:${line.condition}`}
          >
            <div className="row">
              {choice("From", "from", lists)}
              {choice("Condition", "condition", conditions)}
              <span aria-hidden="true">→</span>
              {choice("To", "to", lists)}
              <button type="button" aria-label={tr("flow.removeTransition")} onClick={() => change(setTransition(draft, index, null))}>
                ×
              </button>
            </div>
            <Found of={ofTransition(props.findings, line.from, line.condition)} />
          </fieldset>
        );
      })}
    </Panel>
  );
}

function Inputs(props: OfVerb) {
  const [object = "arm"] = Object.keys(props.draft.of.objects ?? {});
  return (
    <NamedPanel
      {...props}
      title={tr("flow.inputParameters")}
      one={tr("flow.inputParameter")}
      place="parameter"
      of={props.draft.of.input_parameters}
      fresh={["goal", { targets: [], default: null, unit: "", tunable: false }]}
      set={setInput}
      rename={renameInput}
      choices={namesOf(props, (item) => item.kind === "input" || item.kind === "parameter" || item.kind === "condition")}
      found={(name) => ofParameter(props.findings, name)}
      fields={(input, put, list) => (
        <>
          <TextField
            label={tr("flow.storedIn")}
            list={list}
            placeholder="block.port"
            value={input.targets.join(", ")}
            commit={(text) => put({ ...input, targets: words(text) })}
          />
          <TextField
            label={tr("flow.default")}
            placeholder={tr("flow.noneRequired")}
            value={constantText(input.default)}
            commit={(text) => {
              const { value, wrong } = givenOf(text);
              if (wrong !== null) return wrong;
              put({ ...input, default: value ?? null });
            }}
          />
          <TextField
            label={tr("flow.unit")}
            placeholder={tr("flow.ofThePort")}
            value={input.unit}
            commit={(unit) => put({ ...input, unit })}
          />
          <TextField
            label={tr("flow.within")}
            placeholder={tr("flow.anyValue")}
            value={(input.within ?? []).join(", ")}
            commit={(text) => {
              const read = withinOf(text);
              if (read.wrong !== undefined) return read.wrong;
              put({ ...input, within: read.value });
            }}
          />
          <TextField
            label={tr("flow.countedFrom")}
            placeholder={tr("flow.0OrObjectCommanded", { object })}
            value={input.counted_from ?? ""}
            commit={(from) => put({ ...input, counted_from: from || null })}
          />
          <label className="row">
            <input type="checkbox" checked={input.tunable} onChange={(event) => put({ ...input, tunable: event.target.checked })} />
            {tr("flow.mayBeSetWhileItRuns")}
          </label>
        </>
      )}
    />
  );
}

/** Suggested exception classes with which a start can be refused; the system accepts any of its exception classes. */
const REFUSED_WITH = ["NotHomed", "NotEnabled", "InvalidState", "OutOfRange", "DeviceFailed", "NotAllowed"];

function Requirements(props: OfVerb) {
  const { objects = {} } = props.draft.of;
  const [object = "arm"] = Object.keys(objects);
  return (
    <NamedPanel
      {...props}
      title={tr("flow.requirements")}
      one={tr("flow.requirement")}
      place="requirement"
      of={props.draft.of.requires ?? {}}
      fresh={[`${object}.homed`, { raises: "NotHomed" }]}
      set={setRequirement}
      rename={renameRequirement}
      choices={REFUSED_WITH}
      found={(name) => ofObject(props.findings, name.split(".")[0] ?? name)}
      fields={(requirement, put, list) => (
        <>
          <TextField
            label={tr("flow.raisesOtherwise")}
            list={list}
            value={requirement.raises}
            commit={(raises) => {
              if (raises === "") return tr("flow.enterAClassOfRefusalsNotHomed");
              put({ ...requirement, raises });
            }}
          />
          <TextField
            label={tr("flow.onlyWhen")}
            placeholder={tr("flow.alwaysOrObjectNeedsHome", { object })}
            value={requirement.when ?? ""}
            commit={(when) => put({ ...requirement, when: when === "" ? null : when })}
          />
          <TextField
            label={tr("flow.remedy")}
            placeholder={tr("flow.remedy")}
            value={requirement.remedy ?? ""}
            commit={(remedy) => put({ ...requirement, remedy })}
          />
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
      title={tr("flow.outputValues")}
      one={tr("flow.outputValue")}
      place="output"
      of={props.draft.of.output_values}
      fresh={["result", ports[0] ?? "block.port"]}
      set={setOutput}
      rename={renameOutput}
      choices={ports}
      found={(name) => ofOutput(props.findings, name)}
      fields={(port, put, list) => <TextField label={tr("flow.readFrom")} list={list} value={port} commit={put} />}
    />
  );
}

function namesOf(props: OfVerb, wanted: (item: Item) => boolean): string[] {
  const blocks = Object.entries(props.draft.of.blocks);
  return blocks.flatMap(([label, use]) =>
    itemsOf(use, props.faces)
      .filter(wanted)
      .map((item) => `${label}.${item.name}`),
  );
}
