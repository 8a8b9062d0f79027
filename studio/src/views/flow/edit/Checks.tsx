// SPDX-License-Identifier: Apache-2.0

import { Panel } from "../../../design/parts";
import type { UnreadField } from "../../../design/unread";
import { tr } from "../../../language/text";
import { about, type Finding } from "./findings";

/** All findings about the draft. Pressing a finding shows its location. */
export function Checks(props: { of: Finding[]; unread: UnreadField[]; isEmpty: boolean; aim: (finding: Finding) => void }) {
  const { unread, aim } = props;
  const findings = [...new Map(props.of.map((finding) => [about(finding), finding])).entries()];
  const count = findings.length + unread.length;
  if (props.isEmpty && count === 0) return <p className="quiet">{tr("flow.dragAComponentIntoTheDrawing")}</p>;
  return (
    <Panel
      title={tr("flow.checks")}
      end={<span role="status">{count === 0 ? tr("flow.allPassed") : tr("flow.countFound", { count })}</span>}
    >
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
                {tr("flow.theFieldLabelCannotBeRead", { label: field.label, wrong: field.wrong })}
              </button>
            </li>
          ))}
        </ul>
      )}
    </Panel>
  );
}
