// SPDX-License-Identifier: Apache-2.0
import type { Alarm, Severity } from "../control/shapes";
import { Refusals, Tag } from "../design/parts";
import { useAction, useLive, useWatched } from "./context";
import { addressOf } from "./route";

const RANKS: Severity[] = ["low", "medium", "high", "critical"];

/** The alarm that is told first: active before past, then the most severe, then the newest. */
export function foremost(alarms: Alarm[]): Alarm | null {
  const rank = (alarm: Alarm) => [Number(alarm.active), RANKS.indexOf(alarm.severity), alarm.time_ns] as const;
  let first: Alarm | null = null;
  for (const alarm of alarms) {
    const [a, b] = [rank(alarm), first && rank(first)];
    const at = b ? a.findIndex((part, index) => part !== b[index]) : 0;
    if (!b || (at >= 0 && (a[at] ?? 0) > (b[at] ?? 0))) first = alarm;
  }
  return first;
}

/** The alarms that are raised, in every view: the first of them in words, how many there are, acknowledging. */
export function AlarmBar() {
  const control = useLive();
  const action = useAction();
  const alarms = useWatched(control.alarms.latest);
  // The emergency stop has a line of its own.
  const raised = (alarms?.current ?? []).filter((alarm) => alarm.code !== "emergency_stop" || !alarm.active);
  const first = foremost(raised);
  if (!first) return null;
  const more = raised.length - 1;
  return (
    <div className={`notice ${first.active ? "bad" : "warn"} alarm`} role="status" aria-label="Alarms">
      <Tag tone={first.active ? "bad" : "warn"}>{first.severity}</Tag>
      <strong>{first.code}</strong>
      <span className="said">
        {first.source && `${first.source}: `}
        {first.text}
        {!first.active && <span className="quiet"> (no longer active)</span>}
      </span>
      <a href={addressOf("system")}>{more > 0 ? `and ${more} more` : "All alarms"}</a>
      {control.may("operate") && !first.acknowledged && (
        <button
          type="button"
          disabled={action.busy}
          onClick={() =>
            action.run(async () => {
              await control.order("acknowledge_alarms", { number: first.number });
              await control.alarms.look();
            })
          }
        >
          Acknowledge
        </button>
      )}
      <Refusals of={action.refusals} />
    </div>
  );
}
