// SPDX-License-Identifier: Apache-2.0

import { seconds } from "../../design/numbers";
import { Panel, Tag, type Tone } from "../../design/parts";
import { tr, trWord } from "../../language/text";
import { addressOf } from "../../shell/route";
import type { RepeatedEntry } from "./happened";

const TONES: Record<string, Tone> = { transition: "accent", fault: "bad", overrun: "warn", late: "warn", start: "good", command: "plain" };

/** Starts, conditions, transitions and ends of one instance with their times, newest first. */
export function History(props: { of: RepeatedEntry[]; instance: string | null }) {
  if (props.instance === null) return null;
  return (
    <Panel
      title={tr("verbs.historyOfInstance", { instance: props.instance })}
      end={<a href={addressOf("log", [], { text: props.instance })}>{tr("verbs.allInTheLog")}</a>}
    >
      {props.of.length === 0 ? (
        <p className="quiet">{tr("verbs.noEventsYetItWasCreated")}</p>
      ) : (
        <div className="history" role="group" aria-label={tr("verbs.history")} tabIndex={0}>
          <table>
            <thead>
              <tr>
                <th scope="col" className="number">
                  {tr("verbs.time")}
                </th>
                <th scope="col">{tr("verbs.kind")}</th>
                <th scope="col">{tr("verbs.what")}</th>
              </tr>
            </thead>
            <tbody>
              {props.of.map((entry) => (
                <tr key={entry.sequence}>
                  <td className="number">{seconds(entry.time_s)}</td>
                  <td>
                    <Tag tone={TONES[entry.kind] ?? "plain"}>{trWord(entry.kind)}</Tag>
                  </td>
                  <td>
                    {entry.text || "–"} {entry.times > 1 && <Tag>{entry.times}×</Tag>}{" "}
                    {entry.who && <span className="quiet">{tr("verbs.byWho", { who: entry.who })}</span>}
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
