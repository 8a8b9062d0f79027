// SPDX-License-Identifier: Apache-2.0
import type { ElkNode } from "elkjs/lib/elk-api";
import { elk } from "../../../design/elk";
import { type Drawing, type Place, portAt, sizeOf } from "./drawing";

const OPTIONS = {
  "elk.algorithm": "layered",
  "elk.direction": "RIGHT",
  "elk.layered.spacing.nodeNodeBetweenLayers": "110",
  "elk.spacing.nodeNode": "28",
  "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
  "elk.separateConnectedComponents": "true",
};

/** From box to box where there is no layout, px. */
const IN_A_ROW = 340;

/** Places for all boxes of a drawing, from left to right along the data; of a drawing that the layout refuses, in one row. */
export async function arrange(drawing: Drawing): Promise<Map<string, Place>> {
  try {
    const laid = await (await elk()).layout(problemOf(drawing));
    return new Map((laid.children ?? []).map((box) => [box.id, { x: box.x ?? 0, y: box.y ?? 0 }]));
  } catch {
    return new Map(drawing.boxes.map((box, index) => [box.id, { x: index * IN_A_ROW, y: 0 }]));
  }
}

/** The drawing as the layout takes it: every port at its height on its side. */
export function problemOf(drawing: Drawing): ElkNode {
  const children = drawing.boxes.map((box) => {
    const { width, height } = sizeOf(box);
    const ports = box.ports.map((port) => ({
      id: portId(box.id, port.side, port.name),
      x: port.side === "input" ? 0 : width,
      y: portAt(box, port),
      width: 1,
      height: 1,
      layoutOptions: { "elk.port.side": port.side === "input" ? "WEST" : "EAST" },
    }));
    return { id: box.id, width, height, ports, layoutOptions: { "elk.portConstraints": "FIXED_POS" } };
  });
  const edges = drawing.wires.map((wire) => ({
    id: wire.id,
    sources: [portId(wire.from.box, "output", wire.from.port)],
    targets: [portId(wire.to.box, "input", wire.to.port)],
  }));
  return { id: "drawing", layoutOptions: OPTIONS, children, edges };
}

function portId(box: string, side: string, port: string): string {
  return `${box}\n${side}\n${port}`;
}
