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
  useReactFlow,
} from "@xyflow/react";
import { tr } from "../../language/text";
import "@xyflow/react/dist/style.css";
import { memo, type RefObject, useEffect, useId, useMemo, useRef, useState } from "react";
import { nodeId, nodeName } from "../../design/nodeIds";
import { own } from "../../design/own";
import "./states.css";
import { type Arrow, arrowsOf, type Shape } from "./shape";
import { ENDING, type LaidBox, type LaidDiagram, layOut, START, shortName } from "./states";

export interface Place {
  x: number;
  y: number;
}

/** Functions for editing states in the diagram, and the findings about them. States are command lists and parts. */
export interface StateEdit {
  chosen: string | null;
  choose: (state: string | null) => void;
  /** Called when a transition is drawn between two states. */
  connect: (from: string, to: string) => void;
  /** Positions that a person has chosen for lists, if lists can be moved. */
  places?: Record<string, Place>;
  move?: (list: string, to: Place) => void;
  found: (state: string) => string[];
  isWrong: (from: string, to: string | null) => boolean;
}

type StateNode = Node<{ box: LaidBox; commands: string[]; about: string; lit: boolean; ending: boolean; wrong: string[] }, LaidBox["kind"]>;

const ListBox = memo(function ListBox(props: NodeProps<StateNode>) {
  const { box, commands, lit, ending, wrong } = props.data;
  return (
    <div className={`list-box list ${lit ? "lit" : ""} ${wrong.length > 0 ? "wrong" : ""}`} title={wrong.join("\n")} data-list={box.name}>
      <Handles />
      <strong>{shortName(box.name, box.within)}</strong>
      {ending && <span className="quiet">{ENDING}</span>}
      {wrong.length > 0 && <span className="quiet"> {tr("verbs.countFindings", { count: wrong.length })}</span>}
      {commands.map((text, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: the same command may stand twice
        <div key={index} className="command">
          {text}
        </div>
      ))}
    </div>
  );
});

/** A part of a composed verb: a state that contains other states. */
const PartBox = memo(function PartBox(props: NodeProps<StateNode>) {
  const { box, about, lit, wrong } = props.data;
  return (
    <div className={`part-box ${lit ? "lit" : ""} ${wrong.length > 0 ? "wrong" : ""}`} title={wrong.join("\n")} data-part={box.name}>
      <Handles />
      <strong>{shortName(box.name, box.within)}</strong> <span className="quiet">{about}</span>
    </div>
  );
});

function Handles() {
  return (
    <>
      <Handle type="target" position={Position.Left} id="there" />
      <Handle type="target" position={Position.Bottom} id="back" className="back" isConnectable={false} />
      <Handle type="source" position={Position.Right} id="there" />
      <Handle type="source" position={Position.Bottom} id="back" className="back" isConnectable={false} />
    </>
  );
}

/** Start or end of a verb in the diagram. */
function Mark(props: NodeProps<StateNode>) {
  const isEnd = props.data.box.kind === "end";
  return (
    <div className={isEnd ? "mark end" : "mark"} aria-hidden="true">
      <Handle type="target" position={Position.Top} id="there" className="back" isConnectable={false} />
      <Handle type="source" position={Position.Bottom} id="there" className="back" isConnectable={false} />
    </div>
  );
}

type Route = Edge<{ path: string; at: Place; conditions: Arrow["conditions"] }, "route">;

/** An arrow as routed by the layout, with its conditions. */
function RouteView(props: EdgeProps<Route>) {
  const { id, data, markerEnd = "" } = props;
  if (!data) return null;
  return (
    <>
      <BaseEdge id={id} path={data.path} markerEnd={markerEnd} />
      <EdgeLabelRenderer>
        <div className="route-label" style={{ transform: `translate(${data.at.x}px, ${data.at.y}px)` }}>
          {data.conditions.map((one) => (
            <div key={one.name} className={one.raises ? "raises" : ""}>
              {one.name}
              {one.raises ? ` ${tr("verbs.raises")}` : ""}
            </div>
          ))}
        </div>
      </EdgeLabelRenderer>
    </>
  );
}

const stateViews = { list: ListBox, part: PartBox, start: Mark, end: Mark };
const edgeViews = { route: RouteView };
const FIT = { maxZoom: 1, padding: 0.1 };
/** Minimum scale of a static diagram, at which its smallest text is 9 px high. */
const SCALE_MIN = 0.82;
/** Width changes up to the width of a scrollbar do not change the scale, px. */
const SCROLLBAR = 20;
/** Spacing of lists in rows until the layout is known, px. */
const [ACROSS, IN_A_ROW, DOWN] = [300, 4, 160];
/** Prefix of the nodes of parts, which distinguishes them from lists of any name. */
const PART = "part:";

/** Returns the layout of the diagram; null until it has been computed, and if computing it fails. */
function useLaid(shape: Shape): LaidDiagram | null {
  const [laid, setLaid] = useState<LaidDiagram | null>(null);
  const drawn = JSON.stringify(shape);
  useEffect(() => {
    let over = false;
    layOut(JSON.parse(drawn) as Shape).then(
      (found) => over || setLaid(found),
      // A diagram that cannot be laid out is shown in rows.
      () => over || setLaid(null),
    );
    return () => {
      over = true;
    };
  }, [drawn]);
  return laid;
}

/** Returns the boxes of the layout; new lists, or all lists if there is no layout, are placed in rows. */
function boxesOf(shape: Shape, laid: LaidDiagram | null): LaidBox[] {
  const known = laid?.boxes ?? [];
  const has = (kind: LaidBox["kind"], name: string) => known.some((box) => box.kind === kind && box.name === name);
  const lists = new Set(shape.lists.map(({ name }) => name));
  const parts = new Set(shape.parts.map(({ name }) => name));
  const there = known.filter(({ kind, name, within }) => {
    if (within !== null && !parts.has(within)) return false;
    return kind === "list" ? lists.has(name) : kind === "part" ? parts.has(name) : true;
  });
  const fresh = shape.lists
    .filter(({ name }) => !has("list", name))
    .map(({ name }, index): LaidBox => {
      const at = { x: (index % IN_A_ROW) * ACROSS, y: (laid?.height ?? 0) + Math.floor(index / IN_A_ROW) * DOWN };
      return { name, kind: "list", within: null, ...at, width: 180, height: 70 };
    });
  return [...there, ...fresh];
}

/**
 * Command lists as states, parts of a composed verb as enclosing states, and transitions as arrows. `present` is the running list,
 * `last` the latest transition. With `edit`, transitions can be drawn; otherwise the diagram is a static picture at its natural size, or
 * somewhat smaller if that lets it fit into the view.
 */
export function StatesCanvas(props: {
  shape: Shape;
  present?: string | null;
  last?: { from: string; to: string } | null;
  edit?: StateEdit;
}) {
  const { shape, present = null, last = null, edit } = props;
  const [moving, setMoving] = useState<{ list: string; at: Place } | null>(null);
  const laid = useLaid(shape);
  const boxes = useMemo(() => boxesOf(shape, laid), [shape, laid]);
  const nodes = useMemo(() => nodesOf(shape, boxes, present, edit, moving), [shape, boxes, present, edit, moving]);
  const edges = useMemo(() => edgesOf(shape, laid, boxes, last, edit, moving?.list ?? null), [shape, laid, boxes, last, edit, moving]);
  const frame = useRef<HTMLDivElement>(null);
  const scale = useScale(frame, laid?.width ?? 0);
  const picture = { width: scale * (laid?.width ?? 0), height: scale * (laid?.height ?? 0) };
  const canvas = (
    <ReactFlow<StateNode, Edge>
      nodes={nodes}
      edges={edges}
      key={laid ? "laid" : "rows"}
      nodeTypes={stateViews}
      edgeTypes={edgeViews}
      onNodesChange={(changes) => {
        if (!edit) return;
        for (const change of changes) {
          if (change.type === "select" && change.selected) edit.choose(nameOf(change.id));
          if (change.type !== "position" || !change.position || !edit.move) continue;
          const at = { x: Math.round(change.position.x), y: Math.round(change.position.y) };
          if (change.dragging) setMoving({ list: nameOf(change.id), at });
          else {
            setMoving(null);
            edit.move(nameOf(change.id), at);
          }
        }
      }}
      onPaneClick={() => edit?.choose(null)}
      onConnect={(line) => edit?.connect(nameOf(line.source), nameOf(line.target))}
      deleteKeyCode={null}
      nodesDraggable={edit?.move !== undefined}
      nodesConnectable={edit !== undefined}
      nodesFocusable={edit !== undefined}
      edgesFocusable={edit !== undefined}
      elementsSelectable={edit !== undefined}
      {...(edit
        ? { fitView: true, fitViewOptions: FIT }
        : {
            panOnDrag: false,
            zoomOnScroll: false,
            zoomOnPinch: false,
            zoomOnDoubleClick: false,
            preventScrolling: false,
            viewport: { x: 0, y: 0, zoom: scale },
            minZoom: SCALE_MIN,
            maxZoom: 1,
          })}
      // Same colour as the arrows.
      defaultMarkerColor={null}
      proOptions={{ hideAttribution: true }}
    >
      {edit && (
        <>
          <Background gap={20} />
          <Controls showInteractive={false} aria-label={tr("verbs.zoom")} />
          <Fitting of={`${picture.width} ${picture.height}`} />
        </>
      )}
    </ReactFlow>
  );
  if (edit) return <div className="canvas states">{canvas}</div>;
  return (
    <div
      ref={frame}
      className="scroll-x states"
      role="group"
      aria-label={present ? tr("verbs.stateDiagramPresentRuns", { present }) : tr("verbs.stateDiagram")}
      tabIndex={0}
    >
      <Told shape={shape} />
      <div className="picture" style={picture}>
        {laid && canvas}
      </div>
    </div>
  );
}

/** Returns the scale at which a picture of this width fits into a frame: at most 1, and 1 if its text would become illegible otherwise. */
function useScale(frame: RefObject<HTMLElement | null>, width: number): number {
  const [wide, setWide] = useState(0);
  useEffect(() => {
    if (!frame.current) return;
    // A scrollbar appears or disappears as the picture changes its height: a scale that followed would change back and forth endlessly.
    const followed = (next: number) => setWide((before) => (Math.abs(next - before) > SCROLLBAR ? next : before));
    const sized = new ResizeObserver(([entry]) => followed(entry?.contentRect.width ?? 0));
    sized.observe(frame.current);
    return () => sized.disconnect();
  }, [frame]);
  const scale = wide / width;
  return scale >= SCALE_MIN && scale < 1 ? scale : 1;
}

/** Fits the whole diagram into view when the size of the layout changes, because a new item may be out of view. */
function Fitting(props: { of: string }) {
  const flow = useReactFlow();
  const fitted = useRef(props.of);
  useEffect(() => {
    if (fitted.current === props.of) return;
    fitted.current = props.of;
    const frame = requestAnimationFrame(() => void flow.fitView(FIT));
    return () => cancelAnimationFrame(frame);
  }, [flow, props.of]);
  return null;
}

/** The arrows of the diagram as text. */
function Told(props: { shape: Shape }) {
  const words = useId();
  return (
    <ul className="unseen" id={words}>
      {arrowsOf(props.shape).map((arrow) => (
        <li key={`${arrow.from} ${arrow.to}`}>
          {arrow.from}: {arrow.conditions.map((one) => one.name).join(", ")}{" "}
          {arrow.to === null ? tr("verbs.endsTheVerb") : tr("verbs.leadsToTo", { to: arrow.to })}
        </li>
      ))}
    </ul>
  );
}

function idOf(box: { kind: LaidBox["kind"]; name: string }): string {
  return nodeId(box.kind === "part" ? `${PART}${box.name}` : box.name);
}

function nameOf(id: string): string {
  const name = nodeName(id);
  return name.startsWith(PART) ? name.slice(PART.length) : name;
}

function nodesOf(
  shape: Shape,
  boxes: LaidBox[],
  present: string | null,
  edit: StateEdit | undefined,
  moving: { list: string; at: Place } | null,
): StateNode[] {
  const commands = new Map(shape.lists.map((list) => [list.name, list.commands]));
  const about = new Map(shape.parts.map((part) => [part.name, part.about]));
  return boxes.map((box): StateNode => {
    const isState = box.kind === "list" || box.kind === "part";
    const put = box.kind === "list" && box.within === null ? own(edit?.places, box.name) : undefined;
    const made: StateNode = {
      id: idOf(box),
      type: box.kind,
      position: moving?.list === box.name && box.kind === "list" ? moving.at : (put ?? { x: box.x, y: box.y }),
      width: box.width,
      height: box.height,
      // React Flow removes the edges of a node without this field whenever the node changes, until it has measured the node again.
      measured: { width: box.width, height: box.height },
      data: {
        box,
        commands: commands.get(box.name) ?? [],
        about: about.get(box.name) ?? "",
        lit: box.kind === "part" ? (present?.startsWith(`${box.name}.`) ?? false) : present === box.name,
        ending: shape.ending === box.name,
        wrong: isState && edit ? edit.found(box.name) : [],
      },
      selected: isState && edit?.chosen === box.name,
      selectable: isState,
      focusable: isState && edit !== undefined,
      draggable: box.kind === "list" && edit?.move !== undefined,
      // Elements that cannot have the focus have no label: the list of arrows describes them.
      ...(isState && edit
        ? { ariaLabel: box.kind === "part" ? tr("verbs.partName", { name: box.name }) : tr("verbs.commandListName", { name: box.name }) }
        : {}),
    };
    return box.within === null ? made : { ...made, parentId: nodeId(`${PART}${box.within}`) };
  });
}

/**
 * Returns one arrow for each pair of states, with all its conditions, along the route computed by the layout unless one of its ends was
 * moved.
 */
function edgesOf(
  shape: Shape,
  laid: LaidDiagram | null,
  boxes: LaidBox[],
  last: { from: string; to: string } | null,
  edit: StateEdit | undefined,
  moving: string | null,
): Edge[] {
  const found = (name: string) => boxes.find((box) => box.kind === "list" && box.name === name) ?? boxes.find((box) => box.name === name);
  const isMoved = (name: string) => name === moving || (edit?.places !== undefined && Object.hasOwn(edit.places, name));
  const begin: Arrow = { from: START, to: shape.initial, conditions: [] };
  return [begin, ...arrowsOf(shape)].flatMap((arrow): Edge[] => {
    const [from, to] = [found(arrow.from), arrow.to === null ? boxes.find((box) => box.kind === "end") : found(arrow.to)];
    if (!from || !to) return [];
    const route = laid?.arrows.find((one) => one.arrow.from === arrow.from && one.arrow.to === arrow.to);
    const way = to.kind === "end" || from.kind === "start" || to.x >= from.x ? "there" : "back";
    const isTaken = last !== null && arrow.from === last.from && arrow.to === last.to;
    const wrong = edit?.isWrong(arrow.from, arrow.to) ?? false;
    const text = arrow.conditions.map((one) => one.name).join(", ");
    const common = {
      id: `${arrow.from} → ${arrow.to ?? "(end)"}`,
      source: idOf(from),
      target: idOf(to),
      sourceHandle: from.kind === "start" ? "there" : way,
      targetHandle: to.kind === "end" ? "there" : way,
      // In front of the states, so that an arrow across a state is visible.
      zIndex: 1,
      markerEnd: { type: MarkerType.ArrowClosed, width: 18, height: 18, markerUnits: "userSpaceOnUse" },
      className: `arrow ${arrow.to === null ? "ends" : ""} ${isTaken ? "taken" : ""} ${wrong ? "wrong" : ""}`,
      ariaLabel: tr("verbs.fromFromToText", { from: arrow.from, part: arrow.to ?? tr("verbs.theEnd"), text }),
    };
    if (route && !isMoved(arrow.from) && !isMoved(arrow.to ?? ""))
      return [{ ...common, type: "route", data: { path: route.path, at: route.label ?? { x: 0, y: 0 }, conditions: arrow.conditions } }];
    return [
      {
        ...common,
        type: way === "there" ? "default" : "smoothstep",
        label: text,
        labelBgStyle: { fill: "var(--ground)" },
        labelStyle: { fill: wrong ? "var(--bad)" : "var(--text)" },
      },
    ];
  });
}
