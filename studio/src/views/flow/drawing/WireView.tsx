// SPDX-License-Identifier: Apache-2.0
import { BaseEdge, type Edge, EdgeLabelRenderer, type EdgeProps, getBezierPath } from "@xyflow/react";
import { memo } from "react";
import { LiveValue } from "../../../live/LiveValue";
import { portText, type Wire } from "./drawing";

export type WireEdge = Edge<{ wire: Wire }, "wire">;

/** A wire with its current value, or with its findings. */
export const WireView = memo(function WireView(props: EdgeProps<WireEdge>) {
  const wire = props.data?.wire;
  const [path, x, y] = getBezierPath(props);
  if (!wire) return null;
  const wrong = wire.findings.length > 0;
  return (
    <>
      <BaseEdge
        id={props.id}
        path={path}
        interactionWidth={14}
        className={`wire ${wire.mode === "asynchronous" ? "asynchronous" : ""} ${wrong ? "wrong" : ""} ${props.selected ? "chosen" : ""}`}
      />
      {(wrong || wire.live) && (
        <EdgeLabelRenderer>
          <div
            className={`wire-label ${wrong ? "wrong" : ""}`}
            style={{ transform: `translate(-50%, -50%) translate(${x}px, ${y}px)` }}
            title={`${wire.cell}: ${portText(wire)}${wire.findings.map((text) => `\n${text}`).join("")}`}
            data-wire={wire.cell}
          >
            {wrong ? wire.findings.map((text) => <span key={text}>{text}</span>) : null}
            {!wrong && wire.live && <LiveValue name={wire.live} type_text={wire.type_text} unit={wire.unit} />}
          </div>
        </EdgeLabelRenderer>
      )}
    </>
  );
});
