// SPDX-License-Identifier: Apache-2.0

import { useId } from "react";
import { own } from "../../../design/own";
import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { tr } from "../../../language/text";
import * as composed from "./composed";
import type { ComposedDefinition, Step } from "./definition";
import { constantText, givenOf, words } from "./written";

type Of = { draft: ComposedDefinition; change: (draft: ComposedDefinition) => void };

/** Panel of the selected part: its verb, its label, and the names of its parameters, outputs and conditions in the composed verb. */
export function PartPanel(props: Of & { label: string; choose: (label: string | null) => void }) {
  const { draft, label, change, choose } = props;
  const names = composed.namesOf(composed.partOf(draft, label), draft.made_of);
  const called = (name: string, kind: string) => (
    <TextField
      key={`${kind} ${name}`}
      label={`${kind} ${name}`}
      placeholder={name}
      value={own(draft.of.rename, `${label}.${name}`) ?? ""}
      commit={(to) => change(composed.setRename(draft, `${label}.${name}`, to))}
    />
  );
  return (
    <Panel
      title={tr("flow.partLabel", { label })}
      end={
        <>
          <button
            type="button"
            aria-pressed={draft.of.initial === label}
            onClick={() => change(composed.setComposition(draft, { initial: label }))}
          >
            {tr("flow.begins")}
          </button>
          <button
            type="button"
            onClick={() => {
              change(composed.removePart(draft, label));
              choose(null);
            }}
          >
            {tr("flow.remove")}
          </button>
        </>
      }
    >
      <div className="stack">
        <TextField
          label={tr("flow.label")}
          value={label}
          commit={(to) => {
            if (to === "" || to.includes(".")) return tr("flow.theLabelOfAPartMust");
            if (Object.hasOwn(draft.of.parts, to)) return tr("flow.partToAlreadyExists", { to });
            change(composed.renamePart(draft, label, to));
            choose(to);
          }}
        />
        <label className="row">
          <span className="quiet">{tr("flow.isTheVerb")}</span>
          <select value={own(draft.of.parts, label)} onChange={(event) => change(composed.setPart(draft, label, event.target.value))}>
            {[...new Set([own(draft.of.parts, label) ?? "", ...Object.keys(draft.made_of)])].map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
        <p className="quiet">{tr("flow.renamedInTheComposition")}</p>
        {names.objects.map((name) => called(name, "object"))}
        {names.parameters.map((name) => called(name, "parameter"))}
        {names.inputs.map((name) => called(name, "input"))}
        {names.outputs.map((name) => called(name, "output"))}
        {names.conditions.map((name) => called(name, "condition"))}
        {names.inputs.length > 0 && <p className="quiet">{tr("flow.fixedValuesWhichAreNoLonger")}</p>}
        {names.inputs.map((name) => (
          <TextField
            key={name}
            label={tr("flow.alwaysName", { name })}
            placeholder={tr("flow.setAtEachStart")}
            value={constantText(own(draft.of.preset, `${label}.${name}`))}
            commit={(text) => {
              const { value, wrong } = givenOf(text);
              if (wrong !== null) return wrong;
              change(composed.setPreset(draft, `${label}.${name}`, value));
            }}
          />
        ))}
      </div>
    </Panel>
  );
}

/** Transitions between parts or their lists. */
export function StepsPanel(props: Of) {
  const { draft, change } = props;
  const list = useId();
  const states = composed.statesOf(draft);
  const { transitions } = draft.of;
  const [first, second = first] = Object.keys(draft.of.parts);
  const fresh = first === undefined || second === undefined ? null : composed.drawnStep(draft, first, second);
  const put = (index: number, step: Step | null) => change(composed.setStep(draft, index, step));
  return (
    <Panel
      title={tr("flow.transitions")}
      end={
        <button type="button" disabled={!fresh} onClick={() => put(transitions.length, fresh)}>
          {tr("flow.add")}
        </button>
      }
    >
      <datalist id={list}>
        {states.map((name) => (
          <option key={name} value={name} />
        ))}
      </datalist>
      {transitions.length === 0 && <p className="quiet">{tr("flow.drawALineFromOnePart")}</p>}
      {transitions.map((step, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: a transition is known by its place
        <fieldset key={index} aria-label={tr("flow.transitionIndex", { index: index + 1 })}>
          <TextField
            label={tr("flow.from")}
            list={list}
            value={step.from.join(", ")}
            commit={(text) => {
              if (words(text).length === 0) return tr("flow.chooseThePartOrListWhere");
              put(index, { ...step, from: words(text) });
            }}
          />
          <label className="row">
            <span className="quiet">{tr("flow.at")}</span>
            <select
              aria-label={tr("flow.condition")}
              value={step.condition ?? ""}
              onChange={(event) => put(index, { ...step, condition: event.target.value || null })}
            >
              <option value="">{composed.DONE}</option>
              {[...new Set([...(step.condition === null ? [] : [step.condition]), ...composed.conditionsFrom(draft, step.from)])].map(
                (name) => (
                  <option key={name}>{name}</option>
                ),
              )}
            </select>
          </label>
          <div className="row">
            <label className="row">
              <span className="quiet">{tr("flow.to")}</span>
              <select aria-label={tr("flow.to2")} value={step.to} onChange={(event) => put(index, { ...step, to: event.target.value })}>
                {[...new Set([step.to, ...states])].map((name) => (
                  <option key={name}>{name}</option>
                ))}
              </select>
            </label>
            <button type="button" aria-label={tr("flow.removeTransitionIndex", { index: index + 1 })} onClick={() => put(index, null)}>
              ×
            </button>
          </div>
        </fieldset>
      ))}
    </Panel>
  );
}

/** Properties of the whole composition. */
export function CompositionPanel(props: Of) {
  const { draft, change } = props;
  const { initial, together, until, share } = draft.of;
  const put = (whole: Parameters<typeof composed.setComposition>[1]) => change(composed.setComposition(draft, whole));
  return (
    <Panel title={tr("flow.execution")}>
      <div className="stack">
        <label className="row">
          <input type="checkbox" checked={together} onChange={(event) => put({ together: event.target.checked })} />
          {tr("flow.allPartsRunSimultaneously")}
        </label>
        {together ? (
          <label className="row">
            <span className="quiet">{tr("flow.endsWith")}</span>
            <select value={until} onChange={(event) => put({ until: event.target.value === "all" ? "all" : "any" })}>
              <option value="any">{tr("flow.theFirstOfThem")}</option>
              <option value="all">{tr("flow.theLastOfThem")}</option>
            </select>
          </label>
        ) : (
          <label className="row">
            <span className="quiet">{tr("flow.beginsWith")}</span>
            <select value={initial ?? ""} onChange={(event) => put({ initial: event.target.value || null })}>
              <option value="">{tr("flow.theFirstPart")}</option>
              {[...new Set([...(initial === null ? [] : [initial]), ...composed.statesOf(draft)])].map((name) => (
                <option key={name}>{name}</option>
              ))}
            </select>
          </label>
        )}
        <TextField
          label={tr("flow.sharedBlocks")}
          placeholder={tr("flow.none")}
          value={share.join(", ")}
          commit={(text) => put({ share: words(text) })}
        />
      </div>
    </Panel>
  );
}
