// SPDX-License-Identifier: Apache-2.0
import type { InstalledBlock, InstalledInstance } from "../../../control/shapes";
import { period, valueText } from "../../../design/numbers";
import { Panel } from "../../../design/parts";
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
    <section className="side" aria-label="Selection" tabIndex={0}>
      {wire && <WireDetails wire={wire} />}
      {found && <BlockDetails instance={found.instance} block={found.block} />}
      {box && !found && (
        <Panel title={box.title}>
          <p className="quiet">{box.about}</p>
          {box.kind === "svv" && (
            <p>
              <LiveValue name={box.title} type_text={box.ports[0]?.type_text} unit={box.ports[0]?.unit} />{" "}
              <a href={addressOf("scope", [], { names: box.title })}>Scope</a>
            </p>
          )}
        </Panel>
      )}
      {!wire && !box && (
        <p className="quiet">
          Select a box or a wire to see its type, source and values. Solid wires are synchronous, dashed ones asynchronous. Boxes with a
          dashed edge are SVVs and channels.
        </p>
      )}
    </section>
  );
}

function WireDetails(props: { wire: Wire }) {
  const { wire } = props;
  return (
    <Panel title={wire.cell} end={wire.live && <a href={addressOf("scope", [], { names: wire.live })}>Scope</a>}>
      <dl>
        <dt>Value</dt>
        <dd>{wire.live ? <LiveValue name={wire.live} type_text={wire.type_text} unit={wire.unit} /> : "shown at its writer"}</dd>
        <dt>Type</dt>
        <dd>{portText({ ...wire, mode: "" })}</dd>
        <dt>From</dt>
        <dd>
          {wire.from.box} {wire.from.port}
        </dd>
        <dt>To</dt>
        <dd>
          {wire.to.box} {wire.to.port}
          {wire.mode && `, ${wire.mode}`}
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
          <dt>Block</dt>
          <dd>{block.block}</dd>
          <dt>Runs on</dt>
          <dd>{block.source}</dd>
          {block.every_ns !== null && (
            <>
              <dt>Every</dt>
              <dd>{period(block.every_ns)}</dd>
            </>
          )}
        </dl>
        <table>
          <thead>
            <tr>
              <th scope="col">Port</th>
              <th scope="col">Value</th>
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
