// SPDX-License-Identifier: Apache-2.0
import type { Report } from "../control/shapes";
import { seconds, valueText } from "../design/numbers";
import { Tag } from "../design/parts";

/** The end report of one start: the condition, where and when it occurred, and the returned values. */
export function ReportTable(props: { of: Report }) {
  const { of } = props;
  const rows: [string, string][] = [
    ["Instance", `${of.instance}, start ${of.start}`],
    ["Ended", `${seconds(of.time_s)}, ${seconds(of.time_s - of.started_s)} after its start`],
    ["Command list", of.command_list],
  ];
  if (of.block) rows.push(["Block", of.block]);
  if (of.value !== undefined && of.value !== null) rows.push(["Value", valueText(of.value)]);
  if (of.message) rows.push(["Message", of.message]);
  for (const [name, value] of Object.entries(of.outputs)) rows.push([name, valueText(value)]);
  if (of.others.length > 0) rows.push(["Also reported", of.others.map((other) => other.condition).join(", ")]);
  return (
    <table className="report">
      <tbody>
        <tr>
          <th scope="row">Condition</th>
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
