// SPDX-License-Identifier: Apache-2.0

import { useEffect, useId, useState } from "react";
import type { Alarm } from "../control/shapes";
import { worded } from "../control/wording";
import { tr } from "../language/text";
import { Acknowledge, AcknowledgeAll, AlarmTable, AlarmTags, inOrder } from "./AlarmTable";
import { useLive, useWatched } from "./context";
import { addressOf } from "./route";

/** Returns the alarm to be shown first. */
export function foremost(alarms: readonly Alarm[]): Alarm | null {
  return inOrder(alarms)[0] ?? null;
}

/** The alarms of the running system, shown in every view: the most urgent alarm with its severity and state, and all alarms on request. */
export function AlarmBar() {
  const control = useLive();
  const list = useId();
  const [isOpen, setOpen] = useState(false);
  const alarms = useWatched(control.alarms.latest);
  // An active emergency stop has its own line.
  const raised = (alarms?.current ?? []).filter((alarm) => alarm.code !== "emergency_stop" || !alarm.active);
  const shelved = alarms?.shelved?.length ?? 0;
  const first = foremost(raised);
  const isOver = first === null;
  // Once closed by the end of all alarms, the list does not reopen by itself at the next one.
  useEffect(() => {
    if (isOver) setOpen(false);
  }, [isOver]);
  if (!first) return <ShelvedNote count={shelved} />;
  return (
    <section className="alarm-bar" aria-label={tr("shell.alarmBar")}>
      <div className={`notice ${first.active && !first.acknowledged ? "bad" : "warn"} alarm`} role="status" aria-label={tr("shell.alarms")}>
        <AlarmTags of={first} />
        <strong>{first.code}</strong>
        <span className="said">
          {first.source && `${first.source}: `}
          {worded(first.text)}
        </span>
        {!isOpen && <Acknowledge of={first} from={control} />}
        <button type="button" aria-expanded={isOpen} aria-controls={list} onClick={() => setOpen(!isOpen)}>
          {isOpen ? tr("shell.fewer") : tr("shell.allCountAlarms", { count: raised.length })}
        </button>
      </div>
      <div id={list} className="alarm-list" hidden={!isOpen}>
        {isOpen && (
          <>
            <ShelvedNote count={shelved} />
            <AlarmTable of={raised} from={control} />
            <AcknowledgeAll of={raised} from={control} />
          </>
        )}
      </div>
    </section>
  );
}

/** Shows the number of shelved alarms, with a link to them. */
function ShelvedNote(props: { count: number }) {
  if (props.count === 0) return null;
  return (
    <p className="notice quiet shelved-note">
      <a href={addressOf("system")}>{tr("shell.countAlarmsAreShelved", { count: props.count })}</a>
    </p>
  );
}
