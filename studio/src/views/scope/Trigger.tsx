// SPDX-License-Identifier: Apache-2.0

import { useId } from "react";
import { Choice } from "../../design/Choice";
import { Panel } from "../../design/parts";
import { TextField } from "../../design/TextField";
import { tr, trWord } from "../../language/text";
import { useControl, useTopic, useWatched } from "../../shell/context";
import { NumberField } from "./NumberField";
import type { Scope } from "./scope";
import { type Setup, type TraceSetup, type TriggerSetup, traceId } from "./setup";
import type { Edge } from "./signal/trigger";

type Level = Extract<TriggerSetup, { on: "level" }>;
type Event = Extract<TriggerSetup, { on: "event" }>;

const KINDS = ["condition", "start", "transition", "end", "fault", "overrun", "late", "alarm", "emergency_stop"];

/** Event that triggers the scope: a trace that crosses a level, or a log entry. */
export function Trigger(props: { scope: Scope }) {
  const { scope } = props;
  const setup = useWatched(scope.setup);
  const plain = setup.traces.filter((trace) => !trace.derive && trace.component !== null);
  const put = (trigger: TriggerSetup | null) => scope.change(withTrigger(setup, trigger));
  return (
    <Panel title={tr("scope.trigger")}>
      <div className="stack tight">
        <Choice
          label={tr("scope.on")}
          wide
          value={setup.trigger?.on ?? ""}
          put={(chosen) => put(triggerOf(chosen, plain[0] ?? null, scope))}
        >
          <option value="">{tr("scope.nothing")}</option>
          <option value="level" disabled={plain.length === 0}>
            {tr("scope.aLevelOfATrace")}
          </option>
          <option value="event">{tr("scope.anEntryOfTheLog")}</option>
        </Choice>
        {setup.trigger?.on === "level" && <LevelFields scope={scope} trigger={setup.trigger} traces={plain} put={put} />}
        {setup.trigger?.on === "event" && <EventFields trigger={setup.trigger} put={put} />}
        {setup.trigger && (
          <NumberField
            label={tr("scope.pretrigger")}
            unit="ms"
            value={setup.pre_s * 1e3}
            minimum={0}
            maximum={setup.span_s * 1e3}
            put={(value) => scope.change({ ...setup, pre_s: value / 1e3 })}
          />
        )}
      </div>
    </Panel>
  );
}

// Selecting a trigger also selects a sweep that uses it.
function withTrigger(setup: Setup, trigger: TriggerSetup | null): Setup {
  if (!trigger) return { ...setup, trigger, sweep: "roll" };
  return { ...setup, trigger, sweep: setup.sweep === "roll" ? "normal" : setup.sweep };
}

function triggerOf(on: string, first: TraceSetup | null, scope: Scope): TriggerSetup | null {
  if (on === "event") return { on, kind: "start", about: "", text: "" };
  if (on !== "level" || !first) return null;
  return { on, channel: first.channel, component: first.component ?? "", edge: "rising", level: middle(scope, first), hysteresis: 0 };
}

function middle(scope: Scope, trace: TraceSetup): number {
  const measures = scope.rows.get().find((row) => row.id === traceId(trace) && !row.reference)?.measures;
  return measures ? Number(((measures.min + measures.max) / 2).toPrecision(4)) : 0;
}

function LevelFields(props: { scope: Scope; trigger: Level; traces: TraceSetup[]; put: (trigger: Level) => void }) {
  const { scope, trigger, traces, put } = props;
  const id = `${trigger.channel}${trigger.component}`;
  const unit = useWatched(scope.channels).get(trigger.channel)?.unit ?? "";
  const trace = traces.find((one) => traceId(one) === id);
  return (
    <>
      <Choice
        label={tr("scope.trace")}
        wide
        value={id}
        put={(chosen) => {
          const next = traces.find((one) => traceId(one) === chosen);
          if (next) put({ ...trigger, channel: next.channel, component: next.component ?? "", level: middle(scope, next) });
        }}
      >
        {!trace && <option>{id}</option>}
        {traces.map((one) => (
          <option key={traceId(one)}>{traceId(one)}</option>
        ))}
      </Choice>
      <Choice label={tr("scope.edge")} wide value={trigger.edge} put={(chosen) => put({ ...trigger, edge: chosen as Edge })}>
        <option>{tr("scope.rising")}</option>
        <option>{tr("scope.falling")}</option>
        <option>{tr("scope.either")}</option>
      </Choice>
      <NumberField label={tr("scope.level")} unit={unit} value={trigger.level} put={(level) => put({ ...trigger, level })}>
        {trace && (
          <button
            type="button"
            onClick={() => put({ ...trigger, level: middle(scope, trace) })}
            title={tr("scope.midwayBetweenMinimumAndMaximumOn")}
          >
            {tr("scope.middle")}
          </button>
        )}
      </NumberField>
      <NumberField
        label={tr("scope.hysteresis")}
        unit={unit}
        value={trigger.hysteresis}
        minimum={0}
        put={(hysteresis) => put({ ...trigger, hysteresis })}
      />
    </>
  );
}

function EventFields(props: { trigger: Event; put: (trigger: Event) => void }) {
  const { trigger, put } = props;
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const known = useId();
  const names = new Set((installed?.instances ?? []).flatMap((instance) => [instance.name, instance.verb]));
  return (
    <>
      <Choice label={tr("scope.kind")} wide value={trigger.kind} put={(chosen) => put({ ...trigger, kind: chosen })}>
        {KINDS.map((kind) => (
          <option key={kind} value={kind}>
            {trWord(kind)}
          </option>
        ))}
      </Choice>
      <TextField
        wide
        label={tr("scope.about")}
        value={trigger.about}
        list={known}
        placeholder={tr("scope.any")}
        commit={(about) => put({ ...trigger, about })}
      />
      <datalist id={known}>
        {[...names].map((name) => (
          <option key={name}>{name}</option>
        ))}
      </datalist>
      <TextField
        wide
        label={tr("scope.textContains")}
        value={trigger.text}
        placeholder={tr("scope.anything")}
        commit={(text) => put({ ...trigger, text })}
      />
    </>
  );
}
