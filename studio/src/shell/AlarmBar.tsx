// SPDX-License-Identifier: Apache-2.0

import { useId, useState } from "react";
import type { Alarm } from "../control/shapes";
import { worded } from "../control/wording";
import { Acknowledge, AcknowledgeAll, AlarmTable, AlarmTags, inOrder } from "./AlarmTable";
import { useLive, useWatched } from "./context";

/** The alarm that is told first. */
export function foremost(alarms: readonly Alarm[]): Alarm | null {
  return inOrder(alarms)[0] ?? null;
}

/** The alarms of the running system, in every view: the foremost with its severity and state, all of them where that is asked for. */
export function AlarmBar() {
  const control = useLive();
  const list = useId();
  const [isOpen, setOpen] = useState(false);
  const alarms = useWatched(control.alarms.latest);
  // The emergency stop has a line of its own.
  const raised = (alarms?.current ?? []).filter((alarm) => alarm.code !== "emergency_stop" || !alarm.active);
  const first = foremost(raised);
  if (!first) return null;
  return (
    <section className="alarm-bar" aria-label="Alarm bar">
      <div className={`notice ${first.active && !first.acknowledged ? "bad" : "warn"} alarm`} role="status" aria-label="Alarms">
        <AlarmTags of={first} />
        <strong>{first.code}</strong>
        <span className="said">
          {first.source && `${first.source}: `}
          {worded(first.text)}
        </span>
        {!isOpen && <Acknowledge of={first} from={control} />}
        <button type="button" aria-expanded={isOpen} aria-controls={list} onClick={() => setOpen(!isOpen)}>
          {isOpen ? "Fewer" : raised.length === 1 ? "More" : `All ${raised.length} alarms`}
        </button>
      </div>
      <div id={list} className="alarm-list" hidden={!isOpen}>
        {isOpen && (
          <>
            <AlarmTable of={raised} from={control} />
            <AcknowledgeAll of={raised} from={control} />
          </>
        )}
      </div>
    </section>
  );
}
