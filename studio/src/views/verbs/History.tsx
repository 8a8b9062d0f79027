// SPDX-License-Identifier: Apache-2.0
import { seconds } from "../../design/numbers";
import { Panel, Tag, type Tone } from "../../design/parts";
import { addressOf } from "../../shell/route";
import type { RepeatedEntry } from "./happened";

const TONES: Record<string, Tone> = { transition: "accent", fault: "bad", overrun: "warn", late: "warn", start: "good", command: "plain" };

/** Starts, conditions, transitions and ends of one instance with their times, newest first. */
export function History(props: { of: RepeatedEntry[]; instance: string | null }) {
  if (props.instance === null) return null;
  return (
    <Panel title={`History of ${props.instance}`} end={<a href={addressOf("log", [], { text: props.instance })}>All in the log</a>}>
      {props.of.length === 0 ? (
        <p className="quiet">No events yet: it was created but not started.</p>
      ) : (
        <div className="history" role="group" aria-label="History" tabIndex={0}>
          <table>
            <thead>
              <tr>
                <th scope="col" className="number">
                  Time
                </th>
                <th scope="col">Kind</th>
                <th scope="col">What</th>
              </tr>
            </thead>
            <tbody>
              {props.of.map((entry) => (
                <tr key={entry.sequence}>
                  <td className="number">{seconds(entry.time_s)}</td>
                  <td>
                    <Tag tone={TONES[entry.kind] ?? "plain"}>{entry.kind}</Tag>
                  </td>
                  <td>
                    {entry.text || "–"} {entry.times > 1 && <Tag>{entry.times}×</Tag>}{" "}
                    {entry.who && <span className="quiet">by {entry.who}</span>}
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
