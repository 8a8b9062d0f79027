// SPDX-License-Identifier: Apache-2.0
import { Panel, Tag } from "../../design/parts";
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
      title="Real-time rights"
      end={missing.length === 0 ? <Tag tone="good">all granted</Tag> : <Tag tone="warn">{missing.length} missing</Tag>}
    >
      {missing.length === 0 ? (
        <p>Priorities, cores and locked memory were granted as requested.</p>
      ) : (
        <>
          <p>The system runs without these: its results are correct, but its timing depends on the machine.</p>
          <ul className="missing">
            {missing.map((right) => (
              <li key={right}>{right}</li>
            ))}
          </ul>
          <p className="quiet">
            <code>opengpac doctor</code> shows what to change on this machine.
          </p>
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
          <th scope="col">Source</th>
          <th scope="col">Requested</th>
          <th scope="col">Got</th>
        </tr>
      </thead>
      <tbody>
        {props.sources.map((source) => (
          <tr key={source.name}>
            <th scope="row">{source.name}</th>
            <td>{source.rights_asked?.join(", ") || "nothing: time is virtual"}</td>
            <td>{source.rights_missing.length === 0 ? "everything" : `all but: ${source.rights_missing.join("; ")}`}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
