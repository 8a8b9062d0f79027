// SPDX-License-Identifier: Apache-2.0
import { seconds } from "../../design/numbers";
import { Panel } from "../../design/parts";
import { ReportTable } from "../../shell/ReportTable";
import { addressOf } from "../../shell/route";
import type { Line } from "./lines";

/** Details of a line: its full text and, for an end, the end report. */
export function LineDetail(props: { of: Line; close: () => void }) {
  const { of } = props;
  return (
    <Panel
      className="detail"
      title={`${of.kind} of ${of.about} at ${seconds(of.time_s)}`}
      end={
        <>
          {of.report && <a href={addressOf("verbs", [of.report.verb])}>Verb {of.report.verb}</a>}
          <button type="button" onClick={props.close}>
            Close
          </button>
        </>
      }
    >
      {of.isEarlier && <p className="wrong">From an earlier run: the system has been restarted since.</p>}
      <p>{of.text || <span className="quiet">no message</span>}</p>
      {of.who && <p className="quiet">by {of.who}</p>}
      {of.times > 1 && (
        <p className="quiet">
          {of.times} times, first at {seconds(of.first_s)}
        </p>
      )}
      {of.report && <ReportTable of={of.report} />}
    </Panel>
  );
}
