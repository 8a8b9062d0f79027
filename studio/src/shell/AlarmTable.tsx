// SPDX-License-Identifier: Apache-2.0
import type { Alarm, Severity } from "../control/shapes";
import type { Source } from "../control/source";
import { seconds } from "../design/numbers";
import { Refusals, Tag, type Tone } from "../design/parts";
import { useAction } from "./context";

/** The states of an alarm that a person still has to know of, by the words of ISA-18.2. */
export type AlarmState = "active" | "acknowledged" | "returned";

export function stateOf(alarm: Alarm): AlarmState {
  if (!alarm.active) return "returned";
  return alarm.acknowledged ? "acknowledged" : "active";
}

const MEANS: Record<AlarmState, string> = {
  active: "unacknowledged alarm: its cause is there, and nobody has acknowledged it",
  acknowledged: "acknowledged alarm: its cause is there",
  returned: "returned to normal, unacknowledged: its cause is gone, and nobody has acknowledged it",
};

const TONES: Record<Severity, Tone> = { low: "plain", medium: "warn", high: "bad", critical: "bad" };

/** Severity and state of an alarm, each as a word. */
export function AlarmTags(props: { of: Alarm }) {
  const state = stateOf(props.of);
  return (
    <span className="alarm-tags">
      <Tag tone={TONES[props.of.severity]}>{props.of.severity}</Tag>{" "}
      <Tag tone={state === "active" ? "bad" : state === "returned" ? "warn" : "plain"} title={MEANS[state]}>
        {state}
      </Tag>
    </span>
  );
}

/** Acknowledges one alarm; nothing where that is done, or may not be done here. */
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
        aria-label={`Acknowledge ${of.code}${of.source ? ` of ${of.source}` : ""}`}
        onClick={() => action.run(() => from.aside("acknowledge_alarms", { number: of.number }).then(() => from.alarms.look()))}
      >
        Acknowledge
      </button>
      <Refusals of={action.refusals} />
    </>
  );
}

/** Acknowledges all alarms at once. */
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
        Acknowledge all
      </button>
      <Refusals of={action.refusals} />
    </>
  );
}

/** Alarms, one a line, the most urgent first: severity, state, code, where and what, since when, acknowledging it alone. */
export function AlarmTable(props: { of: readonly Alarm[]; from: Source }) {
  return (
    <ul className="alarm-table">
      {inOrder(props.of).map((alarm) => (
        <li key={alarm.number} data-alarm={alarm.code}>
          <AlarmTags of={alarm} />
          <strong>{alarm.code}</strong>
          <span className="said">
            {alarm.source && `${alarm.source}: `}
            {alarm.text}
            {alarm.remedy && <span className="quiet"> {alarm.remedy}</span>}
          </span>
          <span className="quiet small figures">
            {seconds(alarm.time_ns * 1e-9)}
            {alarm.count > 1 && `, ${alarm.count} times`}
          </span>
          <Acknowledge of={alarm} from={props.from} />
        </li>
      ))}
    </ul>
  );
}

const RANKS: Severity[] = ["low", "medium", "high", "critical"];

/** Alarms in the order in which a person needs them: unacknowledged before acknowledged, active before returned, the most severe, the newest. */
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
