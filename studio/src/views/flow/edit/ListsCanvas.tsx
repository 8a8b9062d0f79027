// SPDX-License-Identifier: Apache-2.0
import {
  Background,
  BaseEdge,
  Controls,
  type Edge,
  EdgeLabelRenderer,
  type EdgeProps,
  Handle,
  MarkerType,
  type Node,
  type NodeProps,
  Position,
  ReactFlow,
} from "@xyflow/react";
import { memo, useEffect, useMemo, useState } from "react";
import { commandText, type Shape } from "../../verbs/shape";
import { type Laid, layOut } from "../../verbs/states";
import type { Place } from "../drawing/drawing";
import type { Draft, Verb } from "./definition";
import { about, type Finding, ofList, ofTransition } from "./findings";

type ListNode = Node<{ name: string; commands: string[]; initial: boolean; ending: boolean; wrong: string[] }, "list">;

const ListBox = memo(function ListBox(props: NodeProps<ListNode>) {
  const { name, commands, initial, ending, wrong } = props.data;
  return (
    <div className={`list-box ${initial ? "initial" : ""} ${wrong.length > 0 ? "wrong" : ""}`} title={wrong.join("\n")} data-list={name}>
      <Handle type="target" position={Position.Left} id="there" />
      <Handle type="target" position={Position.Bottom} id="back" className="back" isConnectable={false} />
      <strong>{name}</strong>
      <span className="quiet">
        {initial && " begins"}
        {ending && " at every end"}
      </span>
      {commands.map((text, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: the same command may stand twice
        <div key={index} className="command">
          {text}
        </div>
      ))}
      {wrong.length > 0 && <div>{wrong.length === 1 ? "1 finding" : `${wrong.length} findings`}: see Checks</div>}
      <Handle type="source" position={Position.Right} id="there" />
      <Handle type="source" position={Position.Bottom} id="back" className="back" isConnectable={false} />
    </div>
  );
});

type Route = Edge<{ path: string; at: Place }, "route">;

/** An arrow where the layout put it, with its conditions beside it. */
function RouteView(props: EdgeProps<Route>) {
  const { id, data, label, markerEnd = "", labelStyle } = props;
  if (!data) return null;
  return (
    <>
      <BaseEdge id={id} path={data.path} markerEnd={markerEnd} />
      <EdgeLabelRenderer>
        <div className="route-label" style={{ transform: `translate(${data.at.x}px, ${data.at.y}px)`, color: labelStyle?.fill }}>
          {label}
        </div>
      </EdgeLabelRenderer>
    </>
  );
}

const listViews = { list: ListBox };
const edgeViews = { route: RouteView };
/** Where lists stand until it is known where they belong, px. */
const [ACROSS, IN_A_ROW, DOWN] = [300, 4, 160];

/** What is laid out: the lists and what leads from one to another, as in the diagram of the verb. */
export function shapeOf(of: Verb): Shape {
  const lists = Object.entries(of.command_lists).map(([name, { commands }]) => ({ name, commands: commands.map(commandText) }));
  const conditions = Object.entries(of.conditions).map(([name, { on }]) => ({ name, of: on, raises: false, during: ["(none)"] }));
  const known = new Set(lists.map((list) => list.name));
  const transitions = of.transitions.filter(({ from, to }) => known.has(from) && known.has(to));
  return { lists, conditions, transitions, initial: of.initial ?? lists[0]?.name ?? "", ending: null };
}

/** The layout of the diagram; null until it is there, and where there is none. */
function useLaid(of: Verb): Laid | null {
  const [laid, setLaid] = useState<Laid | null>(null);
  const drawn = JSON.stringify(shapeOf(of));
  useEffect(() => {
    let over = false;
    layOut(JSON.parse(drawn) as Shape).then(
      (found) => over || setLaid(found),
      // What cannot be laid out stands in rows.
      () => over || setLaid(null),
    );
    return () => {
      over = true;
    };
  }, [drawn]);
  return laid;
}

/** Where a list stands: where somebody put it, else where the layout does. */
export function listPlace(of: Verb, laid: Laid | null, name: string, index: number): Place {
  const box = laid?.boxes.find((one) => one.name === name);
  return of.layout[`list:${name}`] ?? box ?? { x: (index % IN_A_ROW) * ACROSS, y: Math.floor(index / IN_A_ROW) * DOWN };
}

/** Command lists as states, transitions as arrows. Drawing from one list to another adds a transition. */
export function ListsCanvas(props: {
  of: Verb;
  findings: Finding[];
  chosen: string | null;
  choose: (list: string | null) => void;
  move: (list: string, to: Place) => void;
  connect: (from: string, to: string) => void;
  theme?: Draft["kind"];
}) {
  const { of, findings, chosen } = props;
  const [moving, setMoving] = useState<{ list: string; at: Place } | null>(null);
  const laid = useLaid(of);
  const initial = of.initial ?? Object.keys(of.command_lists)[0];
  const nodes = useMemo(
    () =>
      Object.entries(of.command_lists).map(
        ([name, list], index): ListNode => ({
          id: name,
          type: "list",
          position: moving?.list === name ? moving.at : listPlace(of, laid, name, index),
          width: widthOf(laid, name),
          data: {
            name,
            commands: list.commands.map(commandText),
            initial: name === initial,
            ending: of.ending === name,
            wrong: ofList(findings, name).map(about),
          },
          selected: chosen === name,
          ariaLabel: `command list ${name}`,
        }),
      ),
    [of, laid, findings, chosen, moving, initial],
  );
  const edges = useMemo(() => arrows(of, laid, findings, moving?.list ?? null), [of, laid, findings, moving]);
  return (
    <div className="canvas">
      <ReactFlow<ListNode, Edge>
        nodes={nodes}
        edges={edges}
        key={laid ? "laid" : "rows"}
        nodeTypes={listViews}
        edgeTypes={edgeViews}
        onNodesChange={(changes) => {
          for (const change of changes) {
            if (change.type === "select" && change.selected) props.choose(change.id);
            if (change.type !== "position" || !change.position) continue;
            const at = { x: Math.round(change.position.x), y: Math.round(change.position.y) };
            if (change.dragging) setMoving({ list: change.id, at });
            else {
              setMoving(null);
              props.move(change.id, at);
            }
          }
        }}
        onPaneClick={() => props.choose(null)}
        onConnect={(line) => props.connect(line.source, line.target)}
        deleteKeyCode={null}
        fitView
        fitViewOptions={{ maxZoom: 1, padding: 0.2 }}
        proOptions={{ hideAttribution: true }}
      >
        <Background gap={20} />
        <Controls showInteractive={false} aria-label="Zoom" />
      </ReactFlow>
    </div>
  );
}

function widthOf(laid: Laid | null, name: string): number {
  return laid?.boxes.find((box) => box.name === name)?.width ?? 180;
}

/** One arrow for each pair of lists, with all conditions that lead along it: where the layout put it, as long as nobody moved an end. */
function arrows(of: Verb, laid: Laid | null, findings: Finding[], moving: string | null): Edge[] {
  const names = Object.keys(of.command_lists);
  const placeOf = (name: string) => listPlace(of, laid, name, names.indexOf(name)).x;
  const isMoved = (name: string) => name === moving || of.layout[`list:${name}`] !== undefined;
  const between = new Map<string, Edge & { label: string }>();
  for (const { from, condition, to } of of.transitions) {
    const id = `${from} → ${to}`;
    const known = between.get(id);
    const way = placeOf(to) > placeOf(from) ? "there" : "back";
    const wrong = ofTransition(findings, from, condition).length > 0 || known?.className === "wrong";
    const route = laid?.arrows.find(({ arrow }) => arrow.from === from && arrow.to === to);
    const isRouted = route !== undefined && !isMoved(from) && !isMoved(to);
    between.set(id, {
      id,
      source: from,
      target: to,
      ...(isRouted
        ? { type: "route", data: { path: route.path, at: route.label ?? { x: 0, y: 0 } } }
        : { type: way === "there" ? "default" : "smoothstep" }),
      sourceHandle: way,
      targetHandle: way,
      label: known ? `${known.label}, ${condition}` : condition,
      // Before the states: an arrow that passes one is seen to pass it.
      zIndex: 1,
      markerEnd: { type: MarkerType.ArrowClosed },
      className: wrong ? "wrong" : "",
      labelBgStyle: { fill: "var(--ground)" },
      labelStyle: { fill: wrong ? "var(--bad)" : "var(--text)" },
    });
  }
  return [...between.values()];
}
