// SPDX-License-Identifier: Apache-2.0
import { useId } from "react";
import { Choice } from "../../design/Choice";
import { Panel } from "../../design/parts";
import { TextField } from "../../design/TextField";
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
    <Panel title="Trigger">
      <div className="stack tight">
        <Choice label="On" wide value={setup.trigger?.on ?? ""} put={(chosen) => put(triggerOf(chosen, plain[0] ?? null, scope))}>
          <option value="">nothing</option>
          <option value="level" disabled={plain.length === 0}>
            a level of a trace
          </option>
          <option value="event">an entry of the log</option>
        </Choice>
        {setup.trigger?.on === "level" && <LevelFields scope={scope} trigger={setup.trigger} traces={plain} put={put} />}
        {setup.trigger?.on === "event" && <EventFields trigger={setup.trigger} put={put} />}
        {setup.trigger && (
          <NumberField
            label="Pretrigger"
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
        label="Trace"
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
      <Choice label="Edge" wide value={trigger.edge} put={(chosen) => put({ ...trigger, edge: chosen as Edge })}>
        <option>rising</option>
        <option>falling</option>
        <option>either</option>
      </Choice>
      <NumberField label="Level" unit={unit} value={trigger.level} put={(level) => put({ ...trigger, level })}>
        {trace && (
          <button
            type="button"
            onClick={() => put({ ...trigger, level: middle(scope, trace) })}
            title="Midway between minimum and maximum on the screen"
          >
            Middle
          </button>
        )}
      </NumberField>
      <NumberField
        label="Hysteresis"
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
      <Choice label="Kind" wide value={trigger.kind} put={(chosen) => put({ ...trigger, kind: chosen })}>
        {KINDS.map((kind) => (
          <option key={kind}>{kind}</option>
        ))}
      </Choice>
      <TextField wide label="About" value={trigger.about} list={known} placeholder="any" commit={(about) => put({ ...trigger, about })} />
      <datalist id={known}>
        {[...names].map((name) => (
          <option key={name}>{name}</option>
        ))}
      </datalist>
      <TextField wide label="Text contains" value={trigger.text} placeholder="anything" commit={(text) => put({ ...trigger, text })} />
    </>
  );
}
