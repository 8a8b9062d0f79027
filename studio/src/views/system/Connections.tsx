// SPDX-License-Identifier: Apache-2.0
import { useMemo } from "react";
import { Panel, Refusals } from "../../design/parts";
import { useControl, useTopic, useWatched } from "../../shell/context";
import { type Connection, connectionsOf } from "./connections";

/** The interconnect: cells between interrupt sources, and the mode in which they are read. */
export function Connections() {
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const trouble = useWatched(control.topics.installed.trouble);
  const connections = useMemo(() => (installed ? connectionsOf(installed) : null), [installed]);
  return (
    <Panel title="Interconnect">
      <Refusals of={trouble} />
      {connections === null ? (
        <p className="quiet">Waiting for the installed graphs…</p>
      ) : connections.length === 0 ? (
        <p className="quiet">
          No values are passed between interrupt sources: no block reads values that a block of another source writes.
        </p>
      ) : (
        <div className="scroll-x" role="group" aria-label="Connections between sources" tabIndex={0}>
          <table>
            <thead>
              <tr>
                <th scope="col">From</th>
                <th scope="col">To</th>
                <th scope="col" className="number">
                  Values
                </th>
                <th scope="col">Values and port modes</th>
              </tr>
            </thead>
            <tbody>
              {connections.map((connection) => (
                <tr key={`${connection.from} ${connection.to}`}>
                  <th scope="row">{connection.from}</th>
                  <td>{connection.to}</td>
                  <td className="number">{connection.cells.length}</td>
                  <td>
                    <Which of={connection} />
                  </td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </Panel>
  );
}

function Which(props: { of: Connection }) {
  const modes = [...new Set(props.of.cells.map((cell) => cell.mode))];
  return modes.map((mode) => {
    const names = props.of.cells.filter((cell) => cell.mode === mode).map((cell) => cell.name);
    return (
      <details key={mode}>
        <summary>
          {names.length} {mode}
        </summary>
        <span className="small">{names.join(", ")}</span>
      </details>
    );
  });
}
