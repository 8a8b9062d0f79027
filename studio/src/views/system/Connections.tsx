// SPDX-License-Identifier: Apache-2.0

import { useMemo } from "react";
import { Panel, Refusals } from "../../design/parts";
import { tr, trWord } from "../../language/text";
import { useControl, useTopic, useWatched } from "../../shell/context";
import { type Connection, connectionsOf } from "./connections";

/** The interconnect: cells between interrupt sources, and the mode in which they are read. */
export function Connections() {
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const trouble = useWatched(control.topics.installed.trouble);
  const connections = useMemo(() => (installed ? connectionsOf(installed) : null), [installed]);
  return (
    <Panel title={tr("system.interconnect")}>
      <Refusals of={trouble} />
      {connections === null ? (
        <p className="quiet">{tr("system.waitingForTheInstalledGraphs")}</p>
      ) : connections.length === 0 ? (
        <p className="quiet">{tr("system.noValuesArePassedBetweenInterrupt")}</p>
      ) : (
        <div className="scroll-x" role="group" aria-label={tr("system.connectionsBetweenSources")} tabIndex={0}>
          <table>
            <thead>
              <tr>
                <th scope="col">{tr("system.from")}</th>
                <th scope="col">{tr("system.to")}</th>
                <th scope="col" className="number">
                  {tr("system.values")}
                </th>
                <th scope="col">{tr("system.valuesAndPortModes")}</th>
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
          {names.length} {trWord(mode)}
        </summary>
        <span className="small">{names.join(", ")}</span>
      </details>
    );
  });
}
