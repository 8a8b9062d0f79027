// SPDX-License-Identifier: Apache-2.0
import type { Configuration, Statistics } from "../../control/shapes";
import { Panel, Tag } from "../../design/parts";
import { LiveValue } from "../../live/LiveValue";

/** The machines that processors reach: whether they are there, and their channels. */
export function PhysicalDevices(props: { configuration: Configuration; now: Statistics }) {
  return Object.entries(props.configuration.physical_devices).map(([name, device]) => {
    const state = props.now.physical_devices[name];
    return (
      <Panel
        key={name}
        title={`Physical device ${name}`}
        end={
          <>
            {state && state.slew_limited > 0 && <Tag tone="warn">{state.slew_limited} writes slew-limited</Tag>}
            {state?.lost ? <Tag tone="bad">lost: {String(state.lost)}</Tag> : <Tag tone="good">there</Tag>}
            <span className="quiet">exchanged by {device.source}</span>
          </>
        }
      >
        <details>
          <summary>{device.channels.length} channels</summary>
          <div className="channels scroll-x" role="group" aria-label={`Channels of ${name}`} tabIndex={0}>
            <table>
              <thead>
                <tr>
                  <th scope="col">Channel</th>
                  <th scope="col">Direction</th>
                  <th scope="col">Type</th>
                  <th scope="col" className="number">
                    Value
                  </th>
                </tr>
              </thead>
              <tbody>
                {device.channels.map((channel) => (
                  <tr key={channel.name}>
                    <th scope="row">{channel.name}</th>
                    <td>{channel.write ? "write" : "read"}</td>
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
