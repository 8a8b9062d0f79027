// SPDX-License-Identifier: Apache-2.0

import {
  Background,
  type Connection,
  Controls,
  type Edge,
  type IsValidConnection,
  type NodeChange,
  ReactFlow,
  useReactFlow,
} from "@xyflow/react";
import { tr } from "../../../language/text";
import "@xyflow/react/dist/style.css";
import { type DragEvent, type KeyboardEvent, memo, type ReactNode, useCallback, useMemo, useRef, useState } from "react";
import { handleId, nodeId, nodeName } from "../../../design/nodeIds";
import { type BoxNode, BoxView } from "./BoxView";
import { type Drawing, type End, type Place, type PortSide, type Selection, sizeOf } from "./drawing";
import { type Elsewhere, Find } from "./Find";
import { Middle } from "./Middle";
import { FIT, Overview, useFar, useFitting, ZOOM_MAX, ZOOM_MIN } from "./Overview";
import { type RegionNode, RegionView } from "./RegionView";
import type { Region } from "./regions";
import { useSlices } from "./slices";
import { type WireEdge, WireView } from "./WireView";

const boxViews = { box: BoxView, region: RegionView };
/** Prefix of region ids, which no box name has. */
const REGION = "region\n";
const wireViews = { wire: WireView };

export interface CanvasProps {
  drawing: Drawing;
  places: ReadonlyMap<string, Place>;
  chosen: Selection;
  choose: (chosen: Selection) => void;
  /** Opens or closes a nested graph. */
  toggle?: (box: string) => void;
  /** Objects that *Find* offers although they are not drawn. */
  elsewhere?: Elsewhere | undefined;
  /** Background areas of the boxes: interrupt sources, instances. */
  regions?: Region[] | undefined;
  /** Box to be centred, once per object. */
  aim?: { box: string | null } | null;
  /** Identity of the drawing. When it changes, the whole drawing is fitted into view. */
  of: string;
  /** Called when a box has been dragged; if undefined, boxes cannot be dragged. */
  move?: ((box: string, to: Place) => void) | undefined;
  edit?: {
    connect: (from: End, to: End) => void;
    /** Called with the port at which a wire starts, and with null when the wire ends. */
    begin: (from: (End & { side: PortSide }) | null) => void;
    isPossible: (from: End, to: End) => boolean;
    /** Called when a wire is dropped on a port at which it cannot end. */
    refuse: (from: End, to: End) => void;
    /** Called when a wire is dropped on empty canvas; `seen` is relative to the corner of the canvas, px. */
    dangle: (from: End & { side: PortSide }, at: Place, seen: Place) => void;
    remove: (boxes: string[], wires: string[]) => void;
    drop: (what: string, at: Place) => void;
  };
  children?: ReactNode;
}

/** A drawing that can be panned, zoomed, navigated with the keyboard (Tab, Enter, arrow keys) and, with `edit`, changed. */
export const Canvas = memo(function Canvas(props: CanvasProps) {
  const { drawing, places, chosen, choose, toggle, edit, regions, move } = props;
  const flow = useReactFlow();
  const [moving, setMoving] = useState<ReadonlyMap<string, Place>>(new Map());
  const isEdited = edit !== undefined;
  const canvas = useRef<HTMLDivElement>(null);
  // A box that is neither selected nor moved keeps the same object, and is not rendered again.
  const laid = useMemo(
    () =>
      drawing.boxes.map(
        (box): BoxNode => ({
          id: nodeId(box.id),
          type: "box",
          position: places.get(box.id) ?? { x: 0, y: 0 },
          data: { box, toggle, wires: isEdited },
          ...sizeOf(box),
          // React Flow removes the edges of a node without this field whenever the node changes, until it has measured the node again.
          measured: sizeOf(box),
          ariaLabel: `${box.title}, ${box.about}`,
        }),
      ),
    [drawing, places, toggle, isEdited],
  );
  const nodes = useMemo(
    () =>
      laid.map((node) => {
        const selected = chosen?.kind === "box" && chosen.id === node.data.box.id;
        const position = moving.get(node.data.box.id);
        return selected || position ? { ...node, selected, position: position ?? node.position } : node;
      }),
    [laid, moving, chosen],
  );
  const grounds = useMemo(
    () =>
      (regions ?? []).map(
        (region): RegionNode => ({
          id: `${REGION}${region.title}`,
          type: "region",
          position: { x: region.x, y: region.y },
          width: region.width,
          height: region.height,
          data: { region },
          zIndex: -1,
          draggable: false,
          selectable: false,
          focusable: false,
          connectable: false,
          deletable: false,
        }),
      ),
    [regions],
  );
  const wires = useMemo(
    () =>
      drawing.wires.map(
        (wire): WireEdge => ({
          id: wire.id,
          type: "wire",
          source: nodeId(wire.from.box),
          sourceHandle: handleId("output", wire.from.port),
          target: nodeId(wire.to.box),
          targetHandle: handleId("input", wire.to.port),
          data: { wire },
          ariaLabel: tr("flow.cellFromPortToPort2", { cell: wire.cell, port: wire.from.port, port2: wire.to.port }),
        }),
      ),
    [drawing],
  );
  const edges = useMemo(
    () => wires.map((edge) => (chosen?.kind === "wire" && chosen.id === edge.id ? { ...edge, selected: true } : edge)),
    [wires, chosen],
  );
  const far = useFar();
  useFitting(props.of, drawing.boxes, places);

  const onNodesChange = useCallback(
    (changes: NodeChange<BoxNode | RegionNode>[]) => {
      for (const change of changes) {
        if (change.type === "select" && change.selected) choose({ kind: "box", id: nodeName(change.id) });
        if (change.type !== "position" || !change.position || !move) continue;
        const box = nodeName(change.id);
        const to = { x: Math.round(change.position.x), y: Math.round(change.position.y) };
        if (change.dragging) {
          setMoving((before) => new Map(before).set(box, to));
        } else {
          setMoving(new Map());
          move(box, to);
        }
      }
    },
    [choose, move],
  );
  const isValid: IsValidConnection<WireEdge> = useCallback(
    (connection) => {
      const ends = endsOf(connection);
      return !!edit && !!ends && edit.isPossible(ends.from, ends.to);
    },
    [edit],
  );
  const drop = (event: DragEvent) => {
    const what = event.dataTransfer.getData("application/x-opengpac-block");
    if (!what || !edit) return;
    event.preventDefault();
    const at = flow.screenToFlowPosition({ x: event.clientX, y: event.clientY });
    edit.drop(what, { x: Math.round(at.x), y: Math.round(at.y) });
  };
  const open = (id: string) => {
    if (drawing.boxes.find((box) => box.id === id)?.opens) toggle?.(id);
  };
  /** Handles keys: Enter selects a box, and opens it if it is already selected. */
  const press = (event: KeyboardEvent) => {
    const box = (event.target as HTMLElement).closest<HTMLElement>(".react-flow__node");
    if (event.key === "Enter" && event.target === box && chosen?.kind === "box" && box?.dataset.id === nodeId(chosen.id)) open(chosen.id);
  };
  const dangle = (event: MouseEvent | TouchEvent, from: HandleAt) => {
    const [side, port] = split(from.id);
    const point = "changedTouches" in event ? event.changedTouches[0] : event;
    const frame = canvas.current?.getBoundingClientRect();
    if (!edit || !point || !frame || (event.target as Element | null)?.closest?.(".react-flow__node")) return;
    const at = flow.screenToFlowPosition({ x: point.clientX, y: point.clientY });
    edit.dangle(
      { box: nodeName(from.nodeId), port, side: side === "input" ? "input" : "output" },
      { x: Math.round(at.x), y: Math.round(at.y) },
      { x: point.clientX - frame.x, y: point.clientY - frame.y },
    );
  };
  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: the boxes in it have the focus
    <div className={far ? "canvas far" : "canvas"} style={far ?? {}} data-testid="canvas" ref={canvas} onKeyDown={press}>
      <ReactFlow<BoxNode | RegionNode, WireEdge>
        nodes={[...grounds, ...useSlices(nodes)]}
        edges={useSlices(edges)}
        nodeTypes={boxViews}
        edgeTypes={wireViews}
        onNodesChange={onNodesChange}
        onEdgeClick={(_, edge) => choose({ kind: "wire", id: edge.id })}
        onEdgesChange={(changes) => {
          for (const change of changes) if (change.type === "select" && change.selected) choose({ kind: "wire", id: change.id });
        }}
        onNodeDoubleClick={(_, node) => open(nodeName(node.id))}
        onPaneClick={() => choose(null)}
        onConnect={(connection) => {
          const ends = endsOf(connection);
          if (ends) edit?.connect(ends.from, ends.to);
        }}
        onConnectStart={(_, start) => {
          const [side, port] = split(start.handleId);
          if (start.nodeId) edit?.begin({ box: nodeName(start.nodeId), port, side: side === "input" ? "input" : "output" });
        }}
        onConnectEnd={(event, state) => {
          const ends = state.fromHandle && state.toHandle ? endsOf(asConnection(state.fromHandle, state.toHandle)) : null;
          if (ends && state.isValid === false) edit?.refuse(ends.from, ends.to);
          edit?.begin(null);
          if (state.fromHandle && !state.toHandle) dangle(event, state.fromHandle);
        }}
        isValidConnection={isValid}
        onDelete={({ nodes: boxes, edges: wires }) =>
          edit?.remove(
            boxes.map((box) => nodeName(box.id)),
            wires.map((wire) => wire.id),
          )
        }
        onDrop={drop}
        onDragOver={(event) => {
          if (edit) event.preventDefault();
        }}
        nodesDraggable={move !== undefined}
        nodesConnectable={isEdited}
        deleteKeyCode={edit ? ["Delete", "Backspace"] : null}
        edgesFocusable
        minZoom={ZOOM_MIN}
        maxZoom={ZOOM_MAX}
        proOptions={{ hideAttribution: true }}
      >
        <Background gap={20} />
        <Controls showInteractive={false} fitViewOptions={FIT} aria-label={tr("flow.zoom")} />
        <Overview boxes={drawing.boxes} places={places} />
        <Middle of={props.aim ?? null} drawing={drawing} places={places} />
        <Find drawing={drawing} places={places} choose={choose} elsewhere={props.elsewhere} />
        {props.children}
      </ReactFlow>
    </div>
  );
});

// A wire can be drawn from either end.
function endsOf(connection: Connection | Edge): { from: End; to: End } | null {
  const [fromSide, fromPort] = split(connection.sourceHandle);
  const [toSide, toPort] = split(connection.targetHandle);
  const [one, other] = [
    { box: nodeName(connection.source), port: fromPort },
    { box: nodeName(connection.target), port: toPort },
  ];
  if (fromSide === toSide) return null;
  return fromSide === "output" ? { from: one, to: other } : { from: other, to: one };
}

interface HandleAt {
  nodeId: string;
  id?: string | null;
}

function asConnection(from: HandleAt, to: HandleAt): Connection {
  return { source: from.nodeId, sourceHandle: from.id ?? null, target: to.nodeId, targetHandle: to.id ?? null };
}

function split(handle: string | null | undefined): [string, string] {
  const [side = "", ...port] = (handle ?? "").split(" ");
  return [side, nodeName(port.join(" "))];
}
