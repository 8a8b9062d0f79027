// SPDX-License-Identifier: Apache-2.0
import type { ElkNode } from "elkjs/lib/elk-api";
import { elk } from "../../../design/elk";
import { type Box, type Drawing, type Place, portAt, sizeOf } from "./drawing";
import type { GroupedDrawing, Region } from "./regions";

/** First the distance between layers, px, in a drawing whose wires show values, and then in one without values. */
const [WITH_VALUES, WITHOUT] = ["110", "60"];

const OPTIONS = {
  "elk.algorithm": "layered",
  "elk.direction": "RIGHT",
  "elk.spacing.nodeNode": "28",
  "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
  "elk.separateConnectedComponents": "true",
};

/** Distance between boxes that have no position, px. */
const IN_A_ROW = 340;

/**
 * Returns positions for all boxes of a drawing, from left to right along the data flow; in one row if the layout engine rejects the
 * drawing.
 */
export async function arrange(drawing: Drawing): Promise<Map<string, Place>> {
  try {
    const laid = await (await elk()).layout(problemOf(drawing));
    return new Map((laid.children ?? []).map((box) => [box.id, { x: box.x ?? 0, y: box.y ?? 0 }]));
  } catch {
    return new Map(drawing.boxes.map((box, index) => [box.id, { x: index * IN_A_ROW, y: 0 }]));
  }
}

/** Converts a drawing to the layout engine's input, with every port at a fixed position. */
export function problemOf(drawing: Drawing): ElkNode {
  const layers = { "elk.layered.spacing.nodeNodeBetweenLayers": drawing.wires.some(({ live }) => live !== null) ? WITH_VALUES : WITHOUT };
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
  return { id: "drawing", layoutOptions: { ...OPTIONS, ...layers }, children, edges };
}

function portId(box: string, side: string, port: string): string {
  return `${box}\n${side}\n${port}`;
}

/** Padding of a region, px. The padding at the top contains the title. */
const ROOM = "[top=64,left=20,bottom=20,right=20]";
const PACKED = { "elk.algorithm": "rectpacking", "elk.aspectRatio": "1.5", "elk.spacing.nodeNode": "40" };

/**
 * Arranges a drawing in regions side by side, with the boxes of each arranged along the data flow. `regionOf` returns the title of a
 * box's region. Wires between regions do not affect the layout. Returns null if the layout engine rejects the drawing.
 */
export async function arrangeIn(drawing: Drawing, regionOf: (box: Box) => string): Promise<GroupedDrawing | null> {
  const of = new Map(drawing.boxes.map((box) => [box.id, regionOf(box)]));
  const titles = [...new Set(of.values())].sort();
  const children = titles.map((title): ElkNode => {
    const boxes = drawing.boxes.filter((box) => of.get(box.id) === title);
    const wires = drawing.wires.filter((wire) => of.get(wire.from.box) === title && of.get(wire.to.box) === title);
    const inner = problemOf({ boxes, wires });
    return { ...inner, id: `region\n${title}`, layoutOptions: { ...inner.layoutOptions, "elk.padding": ROOM, "elk.aspectRatio": "1.5" } };
  });
  const problem: ElkNode = { id: "drawing", layoutOptions: PACKED, children };
  try {
    const laid = await (await elk()).layout(problem);
    const regions = (laid.children ?? []).map(({ x = 0, y = 0, width = 0, height = 0 }, index): Region => {
      const title = titles[index] ?? "";
      return { source: null, title, x, y, width, height };
    });
    const places = (laid.children ?? []).flatMap((region) =>
      (region.children ?? []).map(({ id, x = 0, y = 0 }): [string, Place] => [id, { x: (region.x ?? 0) + x, y: (region.y ?? 0) + y }]),
    );
    return { regions, places: new Map(places) };
  } catch {
    return null;
  }
}
