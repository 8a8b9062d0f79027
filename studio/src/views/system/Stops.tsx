// SPDX-License-Identifier: Apache-2.0

import type { Statistics } from "../../control/shapes";
import { Panel, Refusals, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { AcknowledgeAll, AlarmTable } from "../../shell/AlarmTable";
import { useControl, useWatched } from "../../shell/context";
import { ShelvedAlarms } from "../../shell/Shelving";

/** Reasons why the cell is stopped: emergency stop, pause, lost devices, active alarms. Renders nothing if there are none. */
export function Stops(props: { now: Statistics }) {
  const { now } = props;
  const lost = Object.entries(now.physical_devices).filter(([, device]) => device.lost);
  return (
    <>
      {now.emergency !== null && (
        <Panel title={tr("system.emergencyStop")} end={<Tag tone="bad">{tr("system.latched")}</Tag>}>
          <p>{now.emergency}</p>
          <p className="quiet">{tr("system.everyActionHasEndedAndThe")}</p>
        </Panel>
      )}
      {lost.length > 0 && (
        <Panel title={tr("system.physicalDevicesLost")} end={<Tag tone="bad">{lost.length}</Tag>}>
          <ul>
            {lost.map(([name, device]) => (
              <li key={name}>
                <strong>{name}</strong>: {String(device.lost)}
              </li>
            ))}
          </ul>
        </Panel>
      )}
      <RaisedAlarms now_s={now.now_s} />
    </>
  );
}

function RaisedAlarms(props: { now_s: number }) {
  const control = useControl();
  const alarms = useWatched(control.alarms.latest);
  const trouble = useWatched(control.alarms.trouble);
  if (trouble.length > 0) return <Refusals of={trouble} />;
  if (!alarms) return null;
  // Recordings made before alarms could be shelved do not contain this list.
  const shelved = <ShelvedAlarms of={alarms.shelved ?? []} from={control} now_s={props.now_s} />;
  if (alarms.current.length === 0) return shelved;
  return (
    <>
      <Panel
        title={tr("system.alarms")}
        end={
          <>
            <Tag tone="warn">{tr("system.countRaised", { count: alarms.current.length })}</Tag>
            <AcknowledgeAll of={alarms.current} from={control} />
          </>
        }
      >
        <AlarmTable of={alarms.current} from={control} />
      </Panel>
      {shelved}
    </>
  );
}
