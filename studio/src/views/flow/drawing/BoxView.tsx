// SPDX-License-Identifier: Apache-2.0

import { Handle, type Node, type NodeProps, Position, useUpdateNodeInternals } from "@xyflow/react";
import { type CSSProperties, memo, useEffect } from "react";
import { handleId } from "../../../design/nodeIds";
import { Name } from "../../../design/parts";
import { tr } from "../../../language/text";
import { type Box, HEAD, inputsOf, outputsOf, type Port, portText, ROW, titleSize } from "./drawing";
import { sourceColour } from "./sources";

export type BoxNode = Node<{ box: Box; toggle: ((box: string) => void) | undefined; wires: boolean }, "box">;

/** A block, a closed graph, an SVV, a channel, or a port of the whole: its name, its ports, and its findings. */
export const BoxView = memo(function BoxView(props: NodeProps<BoxNode>) {
  const { box, toggle, wires } = props.data;
  const wrong = box.findings.filter((finding) => finding.port === null);
  const ports = box.ports.map((port) => `${port.side} ${port.name}`).join("\n");
  const measureAgain = useUpdateNodeInternals();
  // biome-ignore lint/correctness/useExhaustiveDependencies: the wires end at the ports, wherever these are now
  useEffect(() => measureAgain(props.id), [measureAgain, props.id, ports]);
  return (
    <div
      className={`box ${box.kind} ${box.findings.length > 0 ? "wrong" : ""}`}
      style={{ borderTopColor: sourceColour(box.source) }}
      title={[box.doc, ...box.findings.map((finding) => finding.text)].filter(Boolean).join("\n")}
      data-box={box.title}
    >
      <div className="box-head" style={{ "--head": `${HEAD}px` } as CSSProperties}>
        <strong style={{ "--title-size": `${titleSize(box).toFixed(1)}px` } as CSSProperties}>
          <Name of={box.title} />
        </strong>
        {box.opens && (
          <button
            type="button"
            className="plain nodrag opens"
            aria-expanded={box.opens === "open"}
            aria-label={tr("flow.graphTitle", { part: box.opens === "open" ? tr("flow.close") : tr("flow.open"), title: box.title })}
            onClick={() => toggle?.(box.id)}
          >
            {box.opens === "open" ? "−" : "+"}
          </button>
        )}
        <span className="about">{box.about}</span>
      </div>
      <Ports box={box} ports={inputsOf(box)} wires={wires} />
      <Ports box={box} ports={outputsOf(box)} wires={wires} />
      {wrong.length > 0 && (
        <ul className="box-findings">
          {wrong.map((finding) => (
            <li key={finding.key}>{finding.text}</li>
          ))}
        </ul>
      )}
    </div>
  );
});

function Ports(props: { box: Box; ports: Port[]; wires: boolean }) {
  return props.ports.map((port, row) => {
    const found = props.box.findings.filter((finding) => finding.port === port.name);
    const top = HEAD + row * ROW;
    const input = port.side === "input";
    const text = `${port.name}: ${portText(port)}${port.doc ? `\n${port.doc}` : ""}${found.map((finding) => `\n${finding.text}`).join("")}`;
    return (
      <div
        key={`${port.side} ${port.name}`}
        className={`port ${port.side} ${found.length > 0 ? "wrong" : ""}`}
        style={{ top, height: ROW }}
        title={text}
      >
        <Handle
          type={input ? "target" : "source"}
          position={input ? Position.Left : Position.Right}
          id={handleId(port.side, port.name)}
          isConnectable={props.wires}
          className={port.mode === "asynchronous" ? "hollow" : ""}
          data-port={`${props.box.title}.${port.name}`}
        />
        <span>{port.name}</span>
      </div>
    );
  });
}
