// SPDX-License-Identifier: Apache-2.0
import { Panel } from "../../../design/parts";
import type { UnreadField } from "../../../design/unread";
import { about, type Finding } from "./findings";

/** All findings about the draft. Pressing a finding shows its location. */
export function Checks(props: { of: Finding[]; unread: UnreadField[]; isEmpty: boolean; aim: (finding: Finding) => void }) {
  const { unread, aim } = props;
  const findings = [...new Map(props.of.map((finding) => [about(finding), finding])).entries()];
  const count = findings.length + unread.length;
  if (props.isEmpty && count === 0)
    return (
      <p className="quiet">Drag a component into the drawing, or choose one and press Enter. Then draw wires from outputs to inputs.</p>
    );
  return (
    <Panel title="Checks" end={<span role="status">{count === 0 ? "all passed" : `${count} found`}</span>}>
      {count > 0 && (
        <ul className="refusals">
          {findings.map(([text, finding]) => (
            <li key={text}>
              <button type="button" className="finding" onClick={() => aim(finding)}>
                {text}
              </button>
            </li>
          ))}
          {unread.map((field) => (
            <li key={field.id}>
              <button type="button" className="finding" onClick={() => document.getElementById(field.id)?.focus()}>
                The field “{field.label}” cannot be read: {field.wrong}
              </button>
            </li>
          ))}
        </ul>
      )}
    </Panel>
  );
}
