// SPDX-License-Identifier: Apache-2.0
// Layout of the boxes and arrows of a state diagram, by elkjs, which is loaded when it is first needed.

import type { ElkNode } from "elkjs/lib/elk-api";
import { elk } from "../../design/elk";
import { tr } from "../../language/text";
import { type Arrow, arrowsOf, type Shape } from "./shape";

export const START = "(start)";
export const END = "(end)";
/** Text appended to the name of the list that runs at every end. */
export const ENDING = ` ${tr("verbs.atEveryEnd")}`;
const PART = "part:";
const LETTER = 6.8;
const LINE = 15;
const TITLE = 22;
/** Height of a part whose lists are unknown. */
const EMPTY = 60;

export interface LaidBox {
  name: string;
  kind: "list" | "part" | "start" | "end";
  /** Enclosing part; positions are relative to its corner. */
  within: string | null;
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface LaidDiagram {
  width: number;
  height: number;
  /** Boxes, with parts before their content. */
  boxes: LaidBox[];
  arrows: { arrow: Arrow; path: string; label: { x: number; y: number } | null }[];
}

/** Returns the name of a list relative to its part. */
export function shortName(name: string, part: string | null): string {
  return part === null ? name : name.slice(part.length + 1);
}

/**
 * Returns the graph to be laid out: start and end, a box for each list that is as large as its text, inside the box of its part, and
 * labels on the arrows.
 */
export function graphOf(shape: Shape): { graph: ElkNode; arrows: Arrow[] } {
  const known = new Set([...shape.lists, ...shape.parts].map(({ name }) => name).concat(START));
  // During editing, a transition may name a removed list.
  const arrows = [{ from: START, to: shape.initial, conditions: [] }, ...arrowsOf(shape)].filter(
    ({ from, to }: Arrow) => known.has(from) && (to === null || known.has(to)),
  );
  const listOf = (list: Shape["lists"][number]): ElkNode => {
    const letters = shortName(list.name, list.part).length + (list.name === shape.ending ? ENDING.length : 0);
    return {
      id: list.name,
      width: Math.max(letters * 8 + 24, ...list.commands.map((text) => text.length * LETTER + 22), 90),
      height: TITLE + list.commands.length * LINE + 8,
    };
  };
  const partOf = ({ name, about }: Shape["parts"][number]): ElkNode => {
    const width = (name.length + about.length) * 8 + 40;
    const children = within(name);
    if (children.length === 0) return { id: partId(name), width, height: EMPTY };
    const layoutOptions = {
      "elk.padding": "[top=34,left=14,bottom=14,right=14]",
      "elk.nodeSize.constraints": "MINIMUM_SIZE",
      // For a node with children and direction DOWN, elkjs expects the height first.
      "elk.nodeSize.minimum": `(${EMPTY}, ${width})`,
    };
    return { id: partId(name), children, layoutOptions };
  };
  const within = (part: string | null): ElkNode[] => [
    ...shape.parts.filter((one) => one.within === part).map(partOf),
    ...shape.lists.filter((list) => list.part === part).map(listOf),
  ];
  const lists = new Set(shape.lists.map((list) => list.name));
  const idOf = (name: string) => (name === START || name === END || lists.has(name) ? name : partId(name));
  const edges = arrows.map((arrow, index) => ({
    id: String(index),
    sources: [idOf(arrow.from)],
    targets: [idOf(arrow.to ?? END)],
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
      "elk.hierarchyHandling": "INCLUDE_CHILDREN",
      "elk.json.edgeCoords": "ROOT",
      "elk.edgeRouting": "ORTHOGONAL",
      "elk.layered.spacing.nodeNodeBetweenLayers": "34",
      "elk.spacing.nodeNode": "40",
      "elk.spacing.edgeLabel": "6",
      "elk.spacing.edgeNode": "24",
      "elk.edgeLabels.inline": "false",
      // The first list of the definition is placed first.
      "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
      "elk.layered.cycleBreaking.strategy": "MODEL_ORDER",
      "elk.padding": "[top=6,left=6,bottom=6,right=6]",
    },
    children: [
      { id: START, width: 12, height: 12, layoutOptions: { "elk.layered.layering.layerConstraint": "FIRST" } },
      ...within(null),
      ...ends,
    ],
    edges,
  };
  return { graph, arrows };
}

function labelWidth(arrow: Arrow): number {
  return Math.max(...arrow.conditions.map((one) => (one.name.length + (one.raises ? 9 : 0)) * LETTER)) + 8;
}

export async function layOut(shape: Shape): Promise<LaidDiagram> {
  const { graph, arrows } = graphOf(shape);
  const laid = await (await elk()).layout(graph);
  return {
    width: laid.width ?? 0,
    height: laid.height ?? 0,
    boxes: boxesOf(laid.children ?? [], null),
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

function boxesOf(nodes: ElkNode[], within: string | null): LaidBox[] {
  return nodes.flatMap(({ id, x = 0, y = 0, width = 0, height = 0, children }) => {
    const isPart = id.startsWith(PART);
    const name = isPart ? id.slice(PART.length) : id;
    const kind = isPart ? "part" : id === START ? "start" : id === END ? "end" : "list";
    return [{ name, kind, within, x, y, width, height }, ...boxesOf(children ?? [], name)];
  });
}

function partId(name: string): string {
  return `${PART}${name}`;
}

/** Returns an SVG path through points, with rounded corners. */
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
