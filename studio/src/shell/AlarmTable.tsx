// SPDX-License-Identifier: Apache-2.0

import type { Alarm, Severity } from "../control/shapes";
import type { Source } from "../control/source";
import { worded } from "../control/wording";
import { clockText, dayText, seconds } from "../design/numbers";
import { Refusals, Tag, type Tone } from "../design/parts";
import { tr, trWord } from "../language/text";
import { useAction } from "./context";
import { Shelve } from "./Shelving";

/** States of an alarm that require a person's attention, in ISA-18.2 terminology. */
export type AlarmState = "active" | "acknowledged" | "returned";

export function stateOf(alarm: Alarm): AlarmState {
  if (!alarm.active) return "returned";
  return alarm.acknowledged ? "acknowledged" : "active";
}

const MEANS: Record<AlarmState, string> = {
  active: tr("shell.unacknowledgedAlarmItsCausePersistsAnd"),
  acknowledged: tr("shell.acknowledgedAlarmItsCausePersists"),
  returned: tr("shell.returnedToNormalUnacknowledgedItsCause"),
};

/** Colour and shape of each severity; either of them suffices to distinguish severities. */
export const MARKS: Record<Severity, { tone: Tone; shape: string }> = {
  low: { tone: "plain", shape: "M5 1.5a3.5 3.5 0 1 0 .01 0z" },
  medium: { tone: "warn", shape: "M5 .5 9.5 5 5 9.5.5 5z" },
  high: { tone: "bad", shape: "M5 .5 9.7 9.5H.3z" },
  critical: { tone: "critical", shape: "M1 1h8v8H1z" },
};

/** Severity and state of an alarm in words; a shape also indicates the severity. */
export function AlarmTags(props: { of: Alarm }) {
  const state = stateOf(props.of);
  const { tone, shape } = MARKS[props.of.severity];
  return (
    <span className="alarm-tags">
      <Tag tone={tone}>
        <svg className="shape" viewBox="0 0 10 10" aria-hidden="true">
          <path d={shape} />
        </svg>
        {trWord(props.of.severity)}
      </Tag>{" "}
      <Tag tone={state === "active" ? "bad" : state === "returned" ? "warn" : "plain"} title={MEANS[state]}>
        {trWord(state)}
      </Tag>
    </span>
  );
}

/** Button that acknowledges one alarm; empty if the alarm has already been acknowledged, or may not be acknowledged here. */
export function Acknowledge(props: { of: Alarm; from: Source }) {
  const { of, from } = props;
  const action = useAction();
  if (!from.may("operate") || of.acknowledged) return null;
  return (
    <>
      <button
        type="button"
        data-commands
        disabled={action.busy}
        aria-label={tr("shell.acknowledgeCode", {
          code: of.code,
          part: of.source ? ` ${tr("shell.ofSource", { source: of.source })}` : "",
        })}
        onClick={() => action.run(() => from.aside("acknowledge_alarms", { number: of.number }).then(() => from.alarms.look()))}
      >
        {tr("shell.acknowledge")}
      </button>
      <Refusals of={action.refusals} />
    </>
  );
}

/** Button that acknowledges all alarms. */
export function AcknowledgeAll(props: { of: readonly Alarm[]; from: Source }) {
  const { of, from } = props;
  const action = useAction();
  if (!from.may("operate") || of.every((alarm) => alarm.acknowledged)) return null;
  return (
    <>
      <button
        type="button"
        data-commands
        disabled={action.busy}
        onClick={() => action.run(() => from.aside("acknowledge_alarms", {}).then(() => from.alarms.look()))}
      >
        {tr("shell.acknowledgeAll")}
      </button>
      <Refusals of={action.refusals} />
    </>
  );
}

/**
 * Alarms, one per line, most urgent first: severity, state, code, source and text, wall-clock and system time, and a button to
 * acknowledge the alarm.
 */
export function AlarmTable(props: { of: readonly Alarm[]; from: Source }) {
  return (
    <ul className="alarm-table">
      {inOrder(props.of).map((alarm) => (
        <li key={alarm.number} data-alarm={alarm.code}>
          <AlarmTags of={alarm} />
          <strong>{alarm.code}</strong>
          <span className="said">
            {alarm.source && `${alarm.source}: `}
            {worded(alarm.text)}
            {alarm.remedy && <span className="quiet"> {worded(alarm.remedy)}</span>}
          </span>
          <span className="quiet small figures">
            <span title={dayText(alarm.wall_ns)}>
              {[clockText(alarm.wall_ns), seconds(alarm.time_ns * 1e-9)].filter(Boolean).join(" · ")}
            </span>
            {alarm.count > 1 && tr("shell.countTimes", { count: alarm.count })}
          </span>
          <Acknowledge of={alarm} from={props.from} />
          <Shelve of={alarm} from={props.from} />
        </li>
      ))}
    </ul>
  );
}

const RANKS: Severity[] = ["low", "medium", "high", "critical"];

/** Sorts alarms by urgency: unacknowledged before acknowledged, active before returned, most severe first, then latest first. */
export function inOrder(alarms: readonly Alarm[]): Alarm[] {
  const ranks = (alarm: Alarm) => [
    Number(!alarm.acknowledged),
    Number(alarm.active),
    RANKS.indexOf(alarm.severity),
    alarm.time_ns,
    alarm.number,
  ];
  return alarms.toSorted((a, b) => {
    const [first, second] = [ranks(a), ranks(b)];
    const at = first.findIndex((rank, index) => rank !== second[index]);
    return at < 0 ? 0 : (second[at] ?? 0) - (first[at] ?? 0);
  });
}
