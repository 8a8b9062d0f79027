// SPDX-License-Identifier: Apache-2.0

import { useMemo } from "react";
import { worded } from "../../control/wording";
import { seconds } from "../../design/numbers";
import { Panel, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { useControl, useTopic } from "../../shell/context";
import { ReportTable } from "../../shell/ReportTable";

const MOST = 20;

/** The end reports of a verb, newest first. */
export function Reports(props: { verb: string }) {
  const control = useControl();
  const ends = useTopic(control.topics.ends);
  const reports = useMemo(
    () =>
      (ends?.entries ?? [])
        .filter((end) => end.report.verb === props.verb)
        .toReversed()
        .slice(0, MOST),
    [ends, props.verb],
  );
  return (
    <Panel title={tr("verbs.endReports")}>
      {reports.length === 0 ? (
        <p className="quiet">{tr("verbs.noStartHasEndedYet")}</p>
      ) : (
        <ul className="reports">
          {reports.map(({ number, report }) => (
            <li key={number}>
              <details>
                <summary>
                  <span className="figures">{seconds(report.time_s)}</span> {report.instance}{" "}
                  <Tag tone={report.normal ? "good" : "bad"}>{report.condition}</Tag>{" "}
                  <span className="quiet">{tr("verbs.afterTimeS", { time_s: seconds(report.time_s - report.started_s) })}</span>{" "}
                  {worded(report.message)}
                </summary>
                <ReportTable of={report} />
              </details>
            </li>
          ))}
        </ul>
      )}
    </Panel>
  );
}
