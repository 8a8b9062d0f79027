// SPDX-License-Identifier: Apache-2.0
// Shelving of alarms: hides an alarm from the list for a time, with a reason (ISA-18.2).

import { useId, useState } from "react";
import type { Alarm } from "../control/shapes";
import type { Source } from "../control/source";
import { worded } from "../control/wording";
import { clockText } from "../design/numbers";
import { Panel, Refusals, Tag } from "../design/parts";
import { tr } from "../language/text";
import { useAction } from "./context";

/** Durations offered for shelving, min. */
const OFFERED: [number, string][] = [
  [15, "15 min"],
  [60, "1 h"],
  [8 * 60, "8 h"],
  [24 * 60, "24 h"],
];
const MINUTE_NS = 60_000_000_000;

/** Shelves one alarm, using a form for the reason and the duration. */
export function Shelve(props: { of: Alarm; from: Source }) {
  const { of, from } = props;
  const [isOpen, setOpen] = useState(false);
  if (!from.may("operate") || !of.shelvable) return null;
  const name = `${of.code}${of.source ? ` ${tr("shell.ofSource", { source: of.source })}` : ""}`;
  return (
    <>
      <button type="button" aria-expanded={isOpen} aria-label={tr("shell.shelveName", { name })} onClick={() => setOpen(!isOpen)}>
        {tr("shell.shelve")}
      </button>
      {isOpen && <ShelveForm of={of} from={from} name={name} close={() => setOpen(false)} />}
    </>
  );
}

function ShelveForm(props: { of: Alarm; from: Source; name: string; close: () => void }) {
  const { of, from, name, close } = props;
  const action = useAction();
  const id = useId();
  const [reason, setReason] = useState("");
  const [minutes, setMinutes] = useState(60);
  return (
    <form
      className="shelve row"
      aria-label={tr("shell.shelveName2", { name })}
      data-commands
      onSubmit={(event) => {
        event.preventDefault();
        const asked = { number: of.number, reason, for_ns: minutes * MINUTE_NS };
        void action.run(() => from.aside("shelve_alarm", asked).then(() => from.alarms.look())).then((done) => done && close());
      }}
    >
      <label htmlFor={`${id}-reason`}>{tr("shell.reason")}</label>
      <input id={`${id}-reason`} value={reason} required maxLength={400} onChange={(event) => setReason(event.target.value)} />
      <label htmlFor={`${id}-time`}>{tr("shell.for")}</label>
      <select id={`${id}-time`} value={minutes} onChange={(event) => setMinutes(Number(event.target.value))}>
        {OFFERED.map(([given, text]) => (
          <option key={given} value={given}>
            {text}
          </option>
        ))}
      </select>
      <button type="submit" disabled={action.busy || reason.trim() === ""}>
        {tr("shell.shelve2")}
      </button>
      <button type="button" className="plain" onClick={close}>
        {tr("shell.cancel")}
      </button>
      <Refusals of={action.refusals} />
    </form>
  );
}

/** Formats the remaining time of a shelved alarm. */
export function leftText(left_s: number): string {
  if (left_s <= 90) return `${Math.max(0, Math.ceil(left_s))} s`;
  if (left_s <= 90 * 60) return `${Math.ceil(left_s / 60)} min`;
  return `${(left_s / 3600).toFixed(1)} h`;
}

/** The shelved alarms: who shelved each, why, and how long it remains shelved. */
export function ShelvedAlarms(props: { of: readonly Alarm[]; from: Source; now_s: number }) {
  const { of, from, now_s } = props;
  if (of.length === 0) return null;
  return (
    <Panel title={tr("shell.shelvedAlarms")} end={<Tag tone="plain">{of.length}</Tag>}>
      <ul className="alarm-table">
        {of.map((alarm) => {
          const shelving = alarm.shelvings.at(-1);
          return (
            <li key={alarm.number} data-shelved={alarm.code}>
              <Tag tone="plain">{tr("shell.shelved")}</Tag>
              <strong>{alarm.code}</strong>
              <span className="said">
                {alarm.source && `${alarm.source}: `}
                {worded(alarm.text)}
                {shelving && (
                  <span className="quiet">
                    {" "}
                    {shelving.who}: {shelving.reason}
                  </span>
                )}
              </span>
              {shelving && (
                <span className="quiet small figures">
                  {[
                    tr("shell.sinceWallNs", { wall_ns: clockText(shelving.wall_ns) }),
                    tr("shell.untilNsLeft", { until_ns: leftText(shelving.until_ns * 1e-9 - now_s) }),
                  ].join(" · ")}
                </span>
              )}
              <Unshelve of={alarm} from={from} />
            </li>
          );
        })}
      </ul>
    </Panel>
  );
}

function Unshelve(props: { of: Alarm; from: Source }) {
  const { of, from } = props;
  const action = useAction();
  if (!from.may("operate")) return null;
  return (
    <>
      <button
        type="button"
        data-commands
        disabled={action.busy}
        aria-label={tr("shell.unshelveCode", { code: of.code, part: of.source ? ` ${tr("shell.ofSource", { source: of.source })}` : "" })}
        onClick={() => action.run(() => from.aside("unshelve_alarm", { number: of.number }).then(() => from.alarms.look()))}
      >
        {tr("shell.unshelve")}
      </button>
      <Refusals of={action.refusals} />
    </>
  );
}
