// SPDX-License-Identifier: Apache-2.0
import { ReactFlowProvider } from "@xyflow/react";
import { useCallback, useEffect, useMemo, useState } from "react";
import { Panel, Refusals } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { useLive } from "../../../shell/context";
import { Canvas, type Chosen } from "../drawing/Canvas";
import type { Drawing, End, Place, PortSide, Wire } from "../drawing/drawing";
import { arrange } from "../drawing/layout";
import { BoxPanel } from "./BoxPanel";
import * as change from "./change";
import { pasted } from "./clipboard";
import { useCopyKeys } from "./copyKeys";
import { UnreadDraft } from "./DraftBoundary";
import { type Draft, setsOf } from "./definition";
import { boundaryOf, drawnDraft, placeOf, portOf, type RefusedWire } from "./drawn";
import { FileTools } from "./FileTools";
import { about } from "./findings";
import { useDraft } from "./history";
import { Install } from "./Install";
import { ListPanel } from "./ListPanel";
import { ListsCanvas } from "./ListsCanvas";
import { Palette } from "./Palette";
import { type Possible, useFaces, useFindings, usePossible } from "./system";
import { useUndoKeys } from "./undoKeys";
import { VerbPanel } from "./VerbPanel";

type Drawn = "flow" | "lists";
const NOTHING: Drawing = { boxes: [], wires: [] };

/** Draws graphs and verbs. Nothing reaches the system but questions, until somebody installs. */
export default function Editor() {
  const control = useLive();
  const { draft, file, change: put, place, open, back, again } = useDraft();
  useUndoKeys(back, again);
  const { faces, device_types, trouble } = useFaces(control);
  const { findings, unanswered } = useFindings(control, draft);
  const [shown, setShown] = useState<Drawn>("flow");
  const [list, setList] = useState<string | null>(null);
  const [chosen, setChosen] = useState<Chosen>(null);
  const possible = usePossible(control, draft);
  // The drawing is shown as a whole anew: another one was opened, it was arranged, or something came that may lie outside.
  const [shownAnew, setShownAnew] = useState(0);
  const showAnew = useCallback(() => setShownAnew((before) => before + 1), []);
  const [refused, setRefused] = useState<RefusedWire | null>(null);
  const isPlaced = placed(draft);
  const drawing = useMemo(
    () => (isPlaced ? drawnDraft(draft, faces, findings, refused) : NOTHING),
    [isPlaced, draft, faces, findings, refused],
  );
  const places = useMemo(() => placesOf(drawing.boxes, draft), [drawing, draft]);
  useCopyKeys({
    draft,
    labels:
      chosen === null
        ? Object.keys(draft.of.blocks)
        : chosen.kind === "box" && Object.hasOwn(draft.of.blocks, chosen.id)
          ? [chosen.id]
          : [],
    paste: (piece) => {
      const made = pasted(draft, piece);
      put(made.draft);
      const [first] = made.labels;
      if (first !== undefined && made.labels.length === 1) setChosen({ kind: "box", id: first });
    },
    remove: (labels) => {
      // Where nothing is chosen all is copied, and nothing cut.
      if (chosen === null) return;
      put(labels.reduce(change.removeBlock, draft));
      setChosen(null);
    },
  });
  const presentList = draft.kind === "verb" && list !== null && Object.hasOwn(draft.of.command_lists, list) ? list : null;

  const add = useCallback(
    (block: string, at: Place) => {
      const name = block.split(".").at(-1) ?? block;
      const made = change.addBlock(draft, { block: { subroutine: block }, constants: {} }, name, at);
      put(made.draft);
      setChosen({ kind: "box", id: made.label });
    },
    [draft, put],
  );
  // What was never drawn has no places: it is laid out once its ports are known.
  useEffect(() => {
    if (isPlaced || faces.size === 0) return;
    let over = false;
    void arrange(drawnDraft(draft, faces, [], null)).then((laid) => {
      if (over) return;
      place(change.places(draft, Object.fromEntries(laid)));
      showAnew();
    });
    return () => {
      over = true;
    };
  }, [isPlaced, draft, faces, place, showAnew]);
  const edit = useMemo(
    () => ({
      move: (box: string, to: Place) => put(change.place(draft, box, to)),
      begin: (from: (End & { side: PortSide }) | null) => {
        if (from) setRefused(null);
        possible.ask(from && placeOf(draft, from));
      },
      isPossible: (from: End, to: End) => whyNot(draft, possible, from, to) === null,
      refuse: (from: End, to: End) => {
        const reason = whyNot(draft, possible, from, to);
        if (reason !== null) setRefused({ from, to, reason });
      },
      connect: (from: End, to: End) => {
        const ends = [portOf(draft, from), portOf(draft, to)] as const;
        if (ends[0] !== undefined && ends[1] !== undefined) put(change.connect(draft, ends[0], ends[1], faces));
      },
      remove: (boxes: string[], wires: string[]) => {
        put(removed(draft, boxes, wires, drawing.wires, faces));
        if (wires.includes("refused")) setRefused(null);
        setChosen(null);
      },
      drop: add,
    }),
    [draft, put, faces, possible, add, drawing],
  );
  return (
    <div className="flow editing">
      <div className="tools stack">
        <div className="row">
          <TextField
            label={draft.kind === "graph" ? "Graph" : "Verb"}
            value={draft.of.name}
            commit={(name) => put(change.setText(draft, { name }))}
          />
          <TextField label="is for" value={draft.of.doc} placeholder="what it does" commit={(doc) => put(change.setText(draft, { doc }))} />
          <button type="button" disabled={!back} onClick={() => back?.()}>
            Undo
          </button>
          <button type="button" disabled={!again} onClick={() => again?.()}>
            Redo
          </button>
          <button
            type="button"
            onClick={() =>
              void arrange(drawing).then((laid) => {
                put(change.places(draft, Object.fromEntries(laid)));
                showAnew();
              })
            }
          >
            Arrange
          </button>
          <Boundaries
            draft={draft}
            put={(to) => {
              put(to);
              showAnew();
            }}
          />
          {draft.kind === "verb" && (
            <>
              <button type="button" aria-pressed={shown === "flow"} onClick={() => setShown("flow")}>
                Data flow
              </button>
              <button type="button" aria-pressed={shown === "lists"} onClick={() => setShown("lists")}>
                Command lists
              </button>
            </>
          )}
        </div>
        <FileTools
          draft={draft}
          file={file}
          open={(to, from) => {
            open(to, from);
            showAnew();
          }}
        />
        <UnreadDraft />
        <Refusals of={[...trouble, ...unanswered]} />
      </div>
      <Palette
        faces={faces}
        add={(block) => {
          add(block, freePlace(draft));
          showAnew();
        }}
      />
      {shown === "lists" && draft.kind === "verb" ? (
        <ListsCanvas
          of={draft.of}
          findings={findings}
          chosen={presentList}
          choose={setList}
          move={(name, to) => put(change.place(draft, `list:${name}`, to))}
          connect={(from, to) =>
            put(
              change.setTransition(draft, draft.of.transitions.length, {
                from,
                condition: Object.keys(draft.of.conditions)[0] ?? "completed",
                to,
              }),
            )
          }
        />
      ) : (
        <ReactFlowProvider>
          <Canvas drawing={drawing} places={places} chosen={chosen} choose={setChosen} of={`${draft.kind} ${shownAnew}`} edit={edit} />
        </ReactFlowProvider>
      )}
      <div className="side stack">
        <Findings texts={findings.map(about)} isEmpty={Object.keys(draft.of.blocks).length === 0} />
        {chosen?.kind === "box" && Object.hasOwn(draft.of.blocks, chosen.id) && (
          <BoxPanel draft={draft} label={chosen.id} faces={faces} change={put} choose={(label) => setChosen({ kind: "box", id: label })} />
        )}
        {chosen?.kind === "box" && (
          <BoundaryPanel draft={draft} box={chosen.id} put={put} choose={(id) => setChosen({ kind: "box", id })} />
        )}
        {chosen?.kind === "wire" && <CellPanel draft={draft} wire={drawing.wires.find((wire) => wire.id === chosen.id)} put={put} />}
        {presentList !== null && shown === "lists" && draft.kind === "verb" && (
          <ListPanel draft={draft} list={presentList} findings={findings} change={put} choose={setList} />
        )}
        {draft.kind === "verb" && <VerbPanel draft={draft} faces={faces} device_types={device_types} findings={findings} change={put} />}
        <Install draft={draft} faces={faces} isSound={findings.length === 0 && unanswered.length === 0} />
      </div>
    </div>
  );
}

/** Why two ports cannot be wired. A boundary that binds nothing yet takes any type: it has none of its own. */
function whyNot(draft: Draft, possible: Possible, from: End, to: End): string | null {
  if ([from, to].some((end) => boundaryOf(draft, end.box)?.ports.length === 0)) return null;
  return possible.reason(placeOf(draft, from), placeOf(draft, to));
}

function Boundaries(props: { draft: Draft; put: (draft: Draft) => void }) {
  const { draft, put } = props;
  const kinds = draft.kind === "graph" ? (["inputs", "outputs"] as const) : (["instantiation_parameters"] as const);
  const words = { inputs: "input", outputs: "output", instantiation_parameters: "instantiation parameter" };
  return kinds.map((kind) => (
    <button
      key={kind}
      type="button"
      onClick={() => put(change.addBoundary(draft, kind, words[kind].split(" ")[0] ?? kind, freePlace(draft)))}
    >
      Add {words[kind]}
    </button>
  ));
}

function BoundaryPanel(props: { draft: Draft; box: string; put: (draft: Draft) => void; choose: (box: string) => void }) {
  const { draft, box, put } = props;
  const set = boundaryOf(draft, box);
  if (!set) return null;
  return (
    <Panel
      title={set.name}
      end={
        <button type="button" onClick={() => put(change.removeSet(draft, set.kind, set.name))}>
          Remove
        </button>
      }
    >
      <TextField
        label="Name"
        value={set.name}
        commit={(to) => {
          put(change.renameSet(draft, set.kind, set.name, to));
          props.choose(`${set.kind}:${to}`);
        }}
      />
      <p className="quiet">{set.ports.length > 0 ? `binds ${set.ports.join(", ")}` : "binds nothing yet: draw a wire"}</p>
    </Panel>
  );
}

/** The cell of a wire that is chosen: its name. */
function CellPanel(props: { draft: Draft; wire: Wire | undefined; put: (draft: Draft) => void }) {
  const { draft, wire, put } = props;
  const ports = wire && setsOf(draft, "cells")[wire.cell];
  if (!wire || !ports) return null;
  return (
    <Panel title={`Wire ${wire.cell}`}>
      <TextField label="Cell" value={wire.cell} commit={(to) => put(change.renameSet(draft, "cells", wire.cell, to))} />
      <p className="quiet">{ports.join(", ")}</p>
    </Panel>
  );
}

function Findings(props: { texts: string[]; isEmpty: boolean }) {
  if (props.isEmpty)
    return (
      <p className="quiet">Drag a component into the drawing, or choose one and press Enter. Then draw wires from outputs to inputs.</p>
    );
  return (
    <Panel title="Checks" end={<span role="status">{props.texts.length === 0 ? "all hold" : `${props.texts.length} found`}</span>}>
      {props.texts.length > 0 && (
        <ul className="refusals">
          {props.texts.map((text) => (
            <li key={text}>{text}</li>
          ))}
        </ul>
      )}
    </Panel>
  );
}

function placed(draft: Draft): boolean {
  const labels = Object.keys(draft.of.blocks);
  return labels.length === 0 || labels.some((label) => label in draft.of.layout);
}

/** Places of all boxes; what was never placed stands below the others. */
function placesOf(boxes: { id: string }[], draft: Draft): Map<string, Place> {
  const { y } = freePlace(draft);
  let next = 0;
  return new Map(
    boxes.map((box) => {
      const known = draft.of.layout[box.id];
      if (!known) next += 1;
      return [box.id, known ?? { x: (next - 1) * 240, y }];
    }),
  );
}

function freePlace(draft: Draft): Place {
  const known = Object.entries(draft.of.layout).filter(([what]) => !what.startsWith("list:"));
  const right = Math.max(0, ...known.map(([, at]) => at.x + 240));
  const top = Math.min(...known.map(([, at]) => at.y), 40);
  return { x: right, y: top };
}

function removed(draft: Draft, boxes: string[], wires: string[], drawn: Wire[], faces: Parameters<typeof change.disconnect>[2]): Draft {
  let next = draft;
  for (const id of wires) {
    const wire = drawn.find((one) => one.id === id);
    if (!wire || id === "refused") continue;
    const to = boundaryOf(next, wire.to.box);
    if (to) next = change.release(next, to.kind, to.name, `${wire.from.box}.${wire.from.port}`);
    else next = change.disconnect(next, `${wire.to.box}.${wire.to.port}`, faces);
  }
  for (const box of boxes) {
    const set = boundaryOf(next, box);
    if (set && setsOf(next, set.kind)[set.name]) next = change.removeSet(next, set.kind, set.name);
    else if (box in next.of.blocks) next = change.removeBlock(next, box);
  }
  return next;
}
