// SPDX-License-Identifier: Apache-2.0

import type { Configuration, PhysicalDevice, PhysicalDeviceStatistics, Statistics } from "../../control/shapes";
import { count, duration, withUnit } from "../../design/numbers";
import { Panel, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { LiveValue } from "../../live/LiveValue";
import { Services } from "./Services";

/** The physical devices of the processors: their connections, counters, services and channels. */
export function PhysicalDevices(props: { configuration: Configuration; now: Statistics }) {
  return Object.entries(props.configuration.physical_devices).map(([name, device]) => {
    const state = props.now.physical_devices[name];
    return (
      <Panel
        key={name}
        title={tr("devices.physicalDeviceName", { name })}
        className={state?.lost ? "old" : ""}
        end={
          <>
            {state && state.slew_limited > 0 && (
              <Tag tone="warn">{tr("devices.slewLimitedWritesSlewLimited", { count: state.slew_limited })}</Tag>
            )}
            {state?.lost ? <Tag tone="bad">{tr("devices.lost")}</Tag> : <Tag tone="good">{tr("devices.connected")}</Tag>}
            <span className="quiet">{tr("devices.exchangedBySource", { source: device.source })}</span>
          </>
        }
      >
        {state?.lost && <p className="wrong">{tr("devices.lostLostTheValuesShownAre", { lost: state.lost })}</p>}
        <Driver of={device} />
        <Counters of={device} state={state} />
        <Services device={name} of={device.services ?? []} />
        <details>
          <summary>{tr("devices.countChannels", { count: device.channels.length })}</summary>
          <div className="channels scroll-x" role="group" aria-label={tr("devices.channelsOfName", { name })} tabIndex={0}>
            <table>
              <thead>
                <tr>
                  <th scope="col">{tr("devices.channel")}</th>
                  <th scope="col">{tr("devices.direction")}</th>
                  <th scope="col">{tr("devices.type")}</th>
                  <th scope="col" className="number">
                    {tr("devices.value")}
                  </th>
                </tr>
              </thead>
              <tbody>
                {device.channels.map((channel) => (
                  <tr key={channel.name}>
                    <th scope="row">{channel.name}</th>
                    <td>{channel.write ? tr("devices.write") : tr("devices.read")}</td>
                    <td>{channel.type_text}</td>
                    <td className="number">
                      <LiveValue name={`${name}.${channel.name}`} type_text={channel.type_text} unit={channel.unit} />
                    </td>
                  </tr>
                ))}
              </tbody>
            </table>
          </div>
        </details>
      </Panel>
    );
  });
}

/** Source that exchanges with the driver, and the agents that bring its outputs to their safe state. */
function Driver(props: { of: PhysicalDevice }) {
  const { class: where, safe_state, unguarded_why, watchdog_ns } = props.of;
  const said = [
    where && tr("devices.driverWhere", { where }),
    safe_state &&
      tr("devices.safeStateDocByBy", {
        doc: safe_state.doc,
        by: safe_state.by.join(", "),
        part: safe_state.within_ns > 0 ? ` ${tr("devices.withinWithinNs", { within_ns: duration(safe_state.within_ns) })}` : "",
      }),
    watchdog_ns && tr("devices.watchdogOfTheDeviceWatchdogNs", { watchdog_ns: duration(watchdog_ns) }),
  ].filter(Boolean);
  return (
    <>
      {said.length > 0 && <p className="quiet">{said.join(" · ")}</p>}
      {unguarded_why && <p className="wrong">{unguarded_why}</p>}
    </>
  );
}

/** Counters of the driver: lost and refused frames, retries, ages. */
function Counters(props: { of: PhysicalDevice; state: PhysicalDeviceStatistics | undefined }) {
  const counters = props.of.counters ?? [];
  if (counters.length === 0) return null;
  return (
    <dl className="counters" aria-label={tr("devices.countersOfTheDriver")}>
      {counters.map(({ name, unit, doc }) => {
        const value = props.state?.counters[name];
        return (
          <div key={name} title={doc}>
            <dt>{name}</dt>
            <dd className="figures" data-counter={name}>
              {value === undefined ? "–" : withUnit(unit === "" ? count(value) : String(Number(value.toPrecision(6))), unit)}
            </dd>
          </div>
        );
      })}
    </dl>
  );
}
