// SPDX-License-Identifier: Apache-2.0

import type { Report } from "../control/shapes";
import { seconds, valueText } from "../design/numbers";
import { Tag } from "../design/parts";
import { tr } from "../language/text";

/** The end report of one start: the condition, where and when it occurred, and the returned values. */
export function ReportTable(props: { of: Report }) {
  const { of } = props;
  const rows: [string, string][] = [
    [tr("shell.instance"), tr("shell.instanceStartStart", { instance: of.instance, start: of.start })],
    [tr("shell.ended"), tr("shell.timeSTimeS2AfterIts", { time_s: seconds(of.time_s), time_s2: seconds(of.time_s - of.started_s) })],
    [tr("shell.commandList"), of.command_list],
  ];
  if (of.block) rows.push([tr("shell.block"), of.block]);
  if (of.value !== undefined && of.value !== null) rows.push([tr("shell.value"), valueText(of.value)]);
  if (of.message) rows.push([tr("shell.message"), of.message]);
  for (const [name, value] of Object.entries(of.outputs)) rows.push([name, valueText(value)]);
  if (of.others.length > 0) rows.push([tr("shell.alsoReported"), of.others.map((other) => other.condition).join(", ")]);
  return (
    <table className="report">
      <tbody>
        <tr>
          <th scope="row">{tr("shell.condition")}</th>
          <td>
            <Tag tone={of.normal ? "good" : "bad"}>{of.condition}</Tag>
          </td>
        </tr>
        {rows.map(([name, value]) => (
          <tr key={name}>
            <th scope="row">{name}</th>
            <td className="figures">{value}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
