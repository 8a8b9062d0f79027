// SPDX-License-Identifier: Apache-2.0

import { seconds } from "../../design/numbers";
import { Panel } from "../../design/parts";
import { tr, trWord } from "../../language/text";
import { ReportTable } from "../../shell/ReportTable";
import { addressOf } from "../../shell/route";
import type { Line } from "./lines";

/** Details of a line: its full text and, for an end, the end report. */
export function LineDetail(props: { of: Line; close: () => void }) {
  const { of } = props;
  return (
    <Panel
      className="detail"
      title={tr("log.kindOfAboutAtTimeS", { kind: trWord(of.kind), about: of.about, time_s: seconds(of.time_s) })}
      end={
        <>
          {of.report && <a href={addressOf("verbs", [of.report.verb])}>{tr("log.verbVerb", { verb: of.report.verb })}</a>}
          <button type="button" onClick={props.close}>
            {tr("log.close")}
          </button>
        </>
      }
    >
      {of.isEarlier && <p className="wrong">{tr("log.fromAnEarlierRunTheSystem")}</p>}
      <p>{of.text || <span className="quiet">{tr("log.noMessage")}</span>}</p>
      {of.who && <p className="quiet">{tr("log.byWho", { who: of.who })}</p>}
      {of.times > 1 && <p className="quiet">{tr("log.timesTimesFirstAtFirstS", { times: of.times, first_s: seconds(of.first_s) })}</p>}
      {of.report && <ReportTable of={of.report} />}
    </Panel>
  );
}
