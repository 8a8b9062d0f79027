// SPDX-License-Identifier: Apache-2.0
import { Background, Controls, type Edge, Handle, MarkerType, type Node, type NodeProps, Position, ReactFlow } from "@xyflow/react";
import { memo, useMemo, useState } from "react";
import type { Place } from "../drawing/drawing";
import type { Draft, Verb } from "./definition";
import { about, type Finding, ofList, ofTransition } from "./findings";

type ListNode = Node<{ name: string; commands: number; initial: boolean; ending: boolean; wrong: string[] }, "list">;

const ListBox = memo(function ListBox(props: NodeProps<ListNode>) {
  const { name, commands, initial, ending, wrong } = props.data;
  return (
    <div className={`list-box ${initial ? "initial" : ""} ${wrong.length > 0 ? "wrong" : ""}`} title={wrong.join("\n")} data-list={name}>
      <Handle type="target" position={Position.Left} id="there" />
      <Handle type="target" position={Position.Bottom} id="back" className="back" isConnectable={false} />
      <strong>{name}</strong>
      <div className="quiet">
        {commands} {commands === 1 ? "command" : "commands"}
        {initial && ", begins"}
        {ending && ", at every end"}
      </div>
      {wrong.length > 0 && <div>{wrong.length === 1 ? "1 finding" : `${wrong.length} findings`}: see Checks</div>}
      <Handle type="source" position={Position.Right} id="there" />
      <Handle type="source" position={Position.Bottom} id="back" className="back" isConnectable={false} />
    </div>
  );
});

const listViews = { list: ListBox };
/** Width of a box without its name, of a letter, and of what stands beside a label. */
const [BOX, LETTER, BESIDE] = [40, 8, 60];
const DOWN = 110;
const IN_A_ROW = 4;

/** Where a list stands that was never moved. */
export function listPlace(of: Verb, name: string, index: number): Place {
  return of.layout[`list:${name}`] ?? { x: (index % IN_A_ROW) * across(of), y: Math.floor(index / IN_A_ROW) * DOWN };
}

/** From one list to the next: room for the longest name and for what the arrow between them says. */
export function across(of: Verb): number {
  const names = Math.max(12, ...Object.keys(of.command_lists).map((name) => name.length));
  const between = new Map<string, number>();
  for (const { from, condition, to } of of.transitions) {
    const pair = `${from} ${to}`;
    between.set(pair, (between.get(pair) ?? -2) + condition.length + 2);
  }
  return BOX + names * LETTER + BESIDE + Math.max(4, ...between.values()) * LETTER;
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
  const initial = of.initial ?? Object.keys(of.command_lists)[0];
  const nodes = useMemo(
    () =>
      Object.entries(of.command_lists).map(
        ([name, list], index): ListNode => ({
          id: name,
          type: "list",
          position: moving?.list === name ? moving.at : listPlace(of, name, index),
          data: {
            name,
            commands: list.commands.length,
            initial: name === initial,
            ending: of.ending === name,
            wrong: ofList(findings, name).map(about),
          },
          selected: chosen === name,
          ariaLabel: `command list ${name}`,
        }),
      ),
    [of, findings, chosen, moving, initial],
  );
  const edges = useMemo(() => arrows(of, findings), [of, findings]);
  return (
    <div className="canvas">
      <ReactFlow<ListNode, Edge>
        nodes={nodes}
        edges={edges}
        nodeTypes={listViews}
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

/** One arrow for each pair of lists, with all conditions that lead along it; what leads back to the left goes below. */
function arrows(of: Verb, findings: Finding[]): Edge[] {
  const names = Object.keys(of.command_lists);
  const placeOf = (name: string) => listPlace(of, name, names.indexOf(name)).x;
  const between = new Map<string, Edge & { label: string }>();
  for (const { from, condition, to } of of.transitions) {
    const id = `${from} → ${to}`;
    const known = between.get(id);
    const way = placeOf(to) > placeOf(from) ? "there" : "back";
    const wrong = ofTransition(findings, from, condition).length > 0 || known?.className === "wrong";
    between.set(id, {
      id,
      source: from,
      target: to,
      type: way === "there" ? "default" : "smoothstep",
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
