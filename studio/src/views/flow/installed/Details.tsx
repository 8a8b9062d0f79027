// SPDX-License-Identifier: Apache-2.0

import type { InstalledBlock, InstalledInstance } from "../../../control/shapes";
import { period, valueText } from "../../../design/numbers";
import { Panel } from "../../../design/parts";
import { tr, trWord } from "../../../language/text";
import { LiveValue } from "../../../live/LiveValue";
import { addressOf } from "../../../shell/route";
import type { Selection } from "../drawing/drawing";
import { type Drawing, portText, type Wire } from "../drawing/drawing";

/** Details of the selected box or wire. */
export function Details(props: { drawing: Drawing; chosen: Selection; instances: InstalledInstance[] }) {
  const { chosen, drawing, instances } = props;
  const wire = chosen?.kind === "wire" ? drawing.wires.find((one) => one.id === chosen.id) : undefined;
  const box = chosen?.kind === "box" ? drawing.boxes.find((one) => one.id === chosen.id) : undefined;
  const found = box ? blockOf(box.id, instances) : null;
  return (
    <section className="side" aria-label={tr("flow.selection")} tabIndex={0}>
      {wire && <WireDetails wire={wire} />}
      {found && <BlockDetails instance={found.instance} block={found.block} />}
      {box && !found && (
        <Panel title={box.title}>
          <p className="quiet">{box.about}</p>
          {box.kind === "svv" && (
            <p>
              <LiveValue name={box.title} type_text={box.ports[0]?.type_text} unit={box.ports[0]?.unit} />{" "}
              <a href={addressOf("scope", [], { names: box.title })}>{tr("flow.scope")}</a>
            </p>
          )}
        </Panel>
      )}
      {!wire && !box && <p className="quiet">{tr("flow.selectABoxOrAWire")}</p>}
    </section>
  );
}

function WireDetails(props: { wire: Wire }) {
  const { wire } = props;
  return (
    <Panel title={wire.cell} end={wire.live && <a href={addressOf("scope", [], { names: wire.live })}>{tr("flow.scope")}</a>}>
      <dl>
        <dt>{tr("flow.value")}</dt>
        <dd>{wire.live ? <LiveValue name={wire.live} type_text={wire.type_text} unit={wire.unit} /> : tr("flow.shownAtItsWriter")}</dd>
        <dt>{tr("flow.type2")}</dt>
        <dd>{portText({ ...wire, mode: "" })}</dd>
        <dt>{tr("flow.from")}</dt>
        <dd>
          {wire.from.box} {wire.from.port}
        </dd>
        <dt>{tr("flow.to2")}</dt>
        <dd>
          {wire.to.box} {wire.to.port}
          {wire.mode && `, ${trWord(wire.mode)}`}
        </dd>
      </dl>
    </Panel>
  );
}

function BlockDetails(props: { instance: InstalledInstance; block: InstalledBlock }) {
  const { instance, block } = props;
  return (
    <Panel title={`${instance.name} · ${block.label}`}>
      <div className="stack">
        <p>{block.doc}</p>
        <dl>
          <dt>{tr("flow.block")}</dt>
          <dd>{block.block}</dd>
          <dt>{tr("flow.runsOn2")}</dt>
          <dd>{block.source}</dd>
          {block.every_ns !== null && (
            <>
              <dt>{tr("flow.every2")}</dt>
              <dd>{period(block.every_ns)}</dd>
            </>
          )}
        </dl>
        <table>
          <thead>
            <tr>
              <th scope="col">{tr("flow.port")}</th>
              <th scope="col">{tr("flow.value")}</th>
            </tr>
          </thead>
          <tbody>
            {block.ports.map((port) => (
              <tr key={`${port.direction} ${port.name}`}>
                <td title={port.doc}>
                  {port.name}
                  <div className="quiet small">
                    {port.direction}
                    {port.type_text ? `, ${portText({ type_text: port.type_text, unit: port.unit ?? "", mode: port.mode ?? "" })}` : ""}
                  </div>
                </td>
                <td>
                  {port.value !== undefined && port.value !== null
                    ? valueText(port.value)
                    : isReadable(instance, port.cell) && <LiveValue name={port.cell} type_text={port.type_text} unit={port.unit} />}
                  {port.cell && <div className="quiet small">{port.cell}</div>}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </Panel>
  );
}

/** Returns whether the value of a cell can be read. A device's channel cannot be read, but values that blocks compute from it can. */
function isReadable(instance: InstalledInstance, cell: string | null): cell is string {
  return cell !== null && instance.cells.some((one) => one.name === cell && (one.kind === "svv" || one.kind === "private"));
}

function blockOf(box: string, instances: InstalledInstance[]): { instance: InstalledInstance; block: InstalledBlock } | null {
  for (const instance of instances) {
    const block = instance.blocks.find((one) => `${instance.name}/${one.label}` === box);
    if (block) return { instance, block };
  }
  return null;
}
