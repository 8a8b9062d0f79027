// SPDX-License-Identifier: Apache-2.0

import { Panel, Tag } from "../../design/parts";
import { trNodes } from "../../language/nodes";
import { tr } from "../../language/text";
import type { SourceShown } from "./sources";

/**
 * Privileges that were requested from the operating system, and those that were granted. Without them everything runs, but the timing is
 * unreliable.
 */
export function Rights(props: { sources: SourceShown[]; supervisor: string[] }) {
  const missing = [...new Set([...props.supervisor, ...props.sources.flatMap((source) => source.rights_missing)])];
  const asked = props.sources.some((source) => source.rights_asked !== undefined);
  return (
    <Panel
      title={tr("system.realTimeRights")}
      end={
        missing.length === 0 ? (
          <Tag tone="good">{tr("system.allGranted")}</Tag>
        ) : (
          <Tag tone="warn">{tr("system.countMissing", { count: missing.length })}</Tag>
        )
      }
    >
      {missing.length === 0 ? (
        <p>{tr("system.prioritiesCoresAndLockedMemoryWere")}</p>
      ) : (
        <>
          <p>{tr("system.theSystemRunsWithoutTheseIts")}</p>
          <ul className="missing">
            {missing.map((right) => (
              <li key={right}>{right}</li>
            ))}
          </ul>
          <p className="quiet">{trNodes("system.codeShowsWhatToChangeOn", { code: <code>opengpac doctor</code> })}</p>
        </>
      )}
      {asked && <Asked sources={props.sources} />}
    </Panel>
  );
}

function Asked(props: { sources: SourceShown[] }) {
  return (
    <table className="asked">
      <thead>
        <tr>
          <th scope="col">{tr("system.source")}</th>
          <th scope="col">{tr("system.requested")}</th>
          <th scope="col">{tr("system.got")}</th>
        </tr>
      </thead>
      <tbody>
        {props.sources.map((source) => (
          <tr key={source.name}>
            <th scope="row">{source.name}</th>
            <td>{source.rights_asked?.join(", ") || tr("system.nothingTimeIsVirtual")}</td>
            <td>
              {source.rights_missing.length === 0
                ? tr("system.everything")
                : tr("system.allButRightsMissing", { rights_missing: source.rights_missing.join("; ") })}
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
