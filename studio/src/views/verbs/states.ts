// SPDX-License-Identifier: Apache-2.0
// Where the boxes and arrows of a state diagram lie: laid out by elkjs, which is loaded when it is first needed.
import type { ElkNode } from "elkjs/lib/elk-api";
import { elk } from "../../design/elk";
import { type Arrow, arrowsOf, type Shape } from "./shape";

export const START = "(start)";
export const END = "(end)";
const LETTER = 6.7;
const LINE = 15;
const TITLE = 22;

export interface Laid {
  width: number;
  height: number;
  boxes: { name: string; x: number; y: number; width: number; height: number }[];
  arrows: { arrow: Arrow; path: string; label: { x: number; y: number } | null }[];
}

/** The graph that is laid out: a box for each list, as large as its text; the start and the end; labels beside the arrows. */
export function graphOf(shape: Shape): { graph: ElkNode; arrows: Arrow[] } {
  const arrows: Arrow[] = [{ from: START, to: shape.initial, conditions: [] }, ...arrowsOf(shape)];
  const boxes = shape.lists.map((list) => ({
    id: list.name,
    width: Math.max(list.name.length * 8 + 24, ...list.commands.map((text) => text.length * LETTER + 20), 90),
    height: TITLE + list.commands.length * LINE + 8,
  }));
  const edges = arrows.map((arrow, index) => ({
    id: String(index),
    sources: [arrow.from],
    targets: [arrow.to ?? END],
    labels:
      arrow.conditions.length === 0
        ? []
        : [{ text: arrow.conditions.map((one) => one.name).join("\n"), width: labelWidth(arrow), height: arrow.conditions.length * LINE }],
  }));
  const ends = arrows.some((arrow) => arrow.to === null)
    ? [{ id: END, width: 18, height: 18, layoutOptions: { "elk.layered.layering.layerConstraint": "LAST" } }]
    : [];
  const graph = {
    id: "verb",
    layoutOptions: {
      "elk.algorithm": "layered",
      "elk.direction": "DOWN",
      "elk.edgeRouting": "ORTHOGONAL",
      "elk.layered.spacing.nodeNodeBetweenLayers": "34",
      "elk.spacing.nodeNode": "40",
      "elk.spacing.edgeLabel": "6",
      "elk.spacing.edgeNode": "24",
      "elk.edgeLabels.inline": "false",
      // The first list of the definition stands first.
      "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
      "elk.layered.cycleBreaking.strategy": "MODEL_ORDER",
      "elk.padding": "[top=6,left=6,bottom=6,right=6]",
    },
    children: [{ id: START, width: 12, height: 12, layoutOptions: { "elk.layered.layering.layerConstraint": "FIRST" } }, ...boxes, ...ends],
    edges,
  };
  return { graph, arrows };
}

function labelWidth(arrow: Arrow): number {
  return Math.max(...arrow.conditions.map((one) => (one.name.length + (one.raises ? 9 : 0)) * LETTER)) + 8;
}

export async function layOut(shape: Shape): Promise<Laid> {
  const { graph, arrows } = graphOf(shape);
  const laid = await (await elk()).layout(graph);
  return {
    width: laid.width ?? 0,
    height: laid.height ?? 0,
    boxes: (laid.children ?? []).map((box) => ({
      name: box.id,
      x: box.x ?? 0,
      y: box.y ?? 0,
      width: box.width ?? 0,
      height: box.height ?? 0,
    })),
    arrows: (laid.edges ?? []).flatMap((edge) => {
      const arrow = arrows[Number(edge.id)];
      const section = edge.sections?.[0];
      if (!arrow || !section) return [];
      const label = edge.labels?.[0];
      return [
        {
          arrow,
          path: pathThrough([section.startPoint, ...(section.bendPoints ?? []), section.endPoint]),
          label: label ? { x: label.x ?? 0, y: label.y ?? 0 } : null,
        },
      ];
    }),
  };
}

/** A line through points, its corners rounded. */
export function pathThrough(points: { x: number; y: number }[]): string {
  const round = 6;
  return points
    .map((point, index) => {
      const before = points[index - 1];
      const after = points[index + 1];
      if (!before) return `M${point.x} ${point.y}`;
      if (!after) return `L${point.x} ${point.y}`;
      const into = towards(point, before, round);
      const out = towards(point, after, round);
      return `L${into.x} ${into.y}Q${point.x} ${point.y} ${out.x} ${out.y}`;
    })
    .join("");
}

function towards(from: { x: number; y: number }, to: { x: number; y: number }, most: number) {
  const length = Math.hypot(to.x - from.x, to.y - from.y);
  const part = length === 0 ? 0 : Math.min(most, length / 2) / length;
  return { x: from.x + (to.x - from.x) * part, y: from.y + (to.y - from.y) * part };
}
