// SPDX-License-Identifier: Apache-2.0

import { ReactFlowProvider } from "@xyflow/react";
import { useCallback, useEffect, useMemo, useState } from "react";
import { own } from "../../../design/own";
import { Unread, useUnread } from "../../../design/unread";
import { useLatest } from "../../../design/useLatest";
import { tr } from "../../../language/text";
import { useLive } from "../../../shell/context";
import { type StateEdit, StatesCanvas } from "../../verbs/StatesCanvas";
import { shapeOfDefinition } from "../../verbs/shape";
import { Canvas } from "../drawing/Canvas";
import { type Drawing, type End, type Place, type PortSide, type Selection, sizeOf } from "../drawing/drawing";
import { arrange } from "../drawing/layout";
import { grouped, regionAt } from "../drawing/regions";
import { type Aim, aimOf } from "./aim";
import { Boundaries, BoundaryPanel, WirePanel } from "./BoundaryPanel";
import { BoxPanel } from "./BoxPanel";
import { Checks } from "./Checks";
import * as change from "./change";
import { pasted } from "./clipboard";
import { useCopyKeys } from "./copyKeys";
import { type Draft, type Graph, newGraph } from "./definition";
import { boundaryOf, drawnDraft, placeOf, portOf, type RefusedWire } from "./drawn";
import { everythingIn } from "./elsewhere";
import { definitionsOf } from "./file";
import { about, type Finding, ofList, ofTransition } from "./findings";
import { Head, type Working } from "./Head";
import { Install } from "./Install";
import { ListPanel } from "./ListPanel";
import type { VerbDraft } from "./NamedPanel";
import { findingsWithin, graphsWithin, replaced, standing, type Way, within } from "./nested";
import { Offer } from "./Offer";
import { type WireStart, withOffered } from "./offered";
import { Palette } from "./Palette";
import { placedOn } from "./placement";
import { freePlace, placed, placesOf, removed } from "./places";
import { type Possible, useFaces, useFindings, usePossible } from "./system";
import { VerbPanel } from "./VerbPanel";
import { Where } from "./Where";

type EditorView = "flow" | "lists";
const NOTHING: Drawing = { boxes: [], wires: [] };
/** Position at which offers requested from the keyboard appear, relative to the corner of the canvas, px. */
const BY_KEYBOARD: Place = { x: 80, y: 60 };

/** Editor of a graph or verb, and of its nested graphs. */
export function FlowEditor(props: { work: Working; whole: Draft }) {
  const { work, whole } = props;
  const { change: putWhole, place: placeWhole } = work;
  const control = useLive();
  const { faces, device_types, sources, trouble } = useFaces(control);
  const { findings: all, unanswered } = useFindings(control, whole);
  const [wanted, setWay] = useState<Way>([]);
  // A block on the path may have been removed or renamed: the path is shortened to the part that exists.
  const way = useMemo(() => standing(whole, wanted), [whole, wanted]);
  const draft = useMemo(() => within(whole, way) ?? whole, [whole, way]);
  const put = useCallback((next: Draft) => putWhole(replaced(whole, way, next)), [putWhole, whole, way]);
  const findings = useMemo(() => findingsWithin(all, way), [all, way]);
  const [shown, setShown] = useState<EditorView>("flow");
  const [list, setList] = useState<string | null>(null);
  const [chosen, setChosen] = useState<Selection>(null);
  const [offer, setOffer] = useState<{ from: WireStart; at: Place; seen: Place } | null>(null);
  const possible = usePossible(control, draft);
  // Incremented to fit the whole drawing into view: after opening another one, arranging it, or adding something that may be out of
  // view.
  const [shownAnew, setShownAnew] = useState(0);
  const showAnew = useCallback(() => setShownAnew((before) => before + 1), []);
  const [refused, setRefused] = useState<RefusedWire | null>(null);
  const unread = useUnread();
  const isSound = all.length === 0 && unanswered.length === 0 && unread.fields.length === 0;
  const go = useCallback(
    (to: Way) => {
      setWay(to);
      setChosen(null);
      setOffer(null);
      setRefused(null);
      setShown("flow");
      showAnew();
    },
    [showAnew],
  );
  const [aim, setAim] = useState<Aim | null>(null);
  const aimAt = (finding: Finding) => {
    const next = aimOf(whole, faces, finding);
    if (next.way.join("\n") !== way.join("\n")) go(next.way);
    setShown(next.shown);
    setList(next.list);
    setChosen(next.chosen);
    setAim(next);
  };
  useEffect(() => {
    const place = aim?.field && document.querySelector(`[data-place="${CSS.escape(aim.field)}"]`);
    if (!place) return;
    place.scrollIntoView({ block: "nearest" });
    place.querySelector<HTMLElement>("input, select")?.focus();
  }, [aim]);
  const enter = useCallback((label: string) => go([...way, label]), [go, way]);
  const elsewhere = useMemo(() => ({ here: way.join("."), list: () => everythingIn(whole, faces, go) }), [whole, way, faces, go]);
  const isPlaced = placed(draft);
  const { placement, placeOn } = work;
  const sourceOf = useCallback((label: string) => own(placement, [...way, label].join(".")) ?? null, [placement, way]);
  const drawing = useMemo(
    () => (isPlaced ? coloured(drawnDraft(draft, faces, findings, refused), sourceOf) : NOTHING),
    [isPlaced, draft, faces, findings, refused, sourceOf],
  );
  const [isBySource, setBySource] = useState(false);
  const bySource = useMemo(
    () => (isBySource ? grouped(drawing.boxes, sources, (box) => box.source, tr("flow.theSourceChosenAtStart")) : null),
    [isBySource, drawing, sources],
  );
  const places = useMemo(() => bySource?.places ?? placesOf(drawing.boxes, draft), [bySource, drawing, draft]);
  const runOn = useCallback(
    (label: string, source: string | null) => placeOn(placedOn(placement, [...way, label].join("."), source)),
    [placeOn, placement, way],
  );
  const { graphs, names } = useGraphs(work, whole, way);
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
      // Without a selection, everything is copied but nothing is cut.
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
  const addGraph = (graph: Graph | null) => {
    const empty = newGraph(change.freeName("graph", names)) as Draft & { kind: "graph" };
    const made = change.addBlock(
      draft,
      { block: { graph: graph ?? empty.of }, constants: {} },
      graph?.name ?? empty.of.name,
      freePlace(draft),
    );
    put(made.draft);
    setChosen({ kind: "box", id: made.label });
    showAnew();
  };
  // A definition that was never drawn has no positions: it is laid out when its ports are known.
  useEffect(() => {
    if (isPlaced || faces.size === 0) return;
    let over = false;
    void arrange(drawnDraft(draft, faces, [], null)).then((laid) => {
      if (over) return;
      placeWhole(replaced(whole, way, change.places(draft, Object.fromEntries(laid))));
      showAnew();
    });
    return () => {
      over = true;
    };
  }, [isPlaced, draft, whole, way, faces, placeWhole, showAnew]);
  const move = useCallback(
    (box: string, to: Place) => {
      if (!bySource) return put(change.place(draft, box, to));
      const size = drawing.boxes.find((one) => one.id === box);
      const { width, height } = size ? sizeOf(size) : { width: 0, height: 0 };
      const region = regionAt(bySource.regions, { x: to.x + width / 2, y: to.y + height / 2 });
      if (region && Object.hasOwn(draft.of.blocks, box)) runOn(box, region.source);
    },
    [put, draft, bySource, drawing, runOn],
  );
  const edit = useMemo(
    () => ({
      begin: (from: (End & { side: PortSide }) | null) => {
        if (from) setRefused(null);
        possible.ask(from && placeOf(draft, from));
      },
      isPossible: (from: End, to: End) => whyNot(draft, possible, from, to) === null,
      refuse: (from: End, to: End) => {
        const reason = whyNot(draft, possible, from, to);
        if (reason !== null) setRefused({ from, to, reason });
      },
      dangle: (from: WireStart, at: Place, seen: Place) => setOffer({ from, at, seen }),
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
  const latest = useLatest({ draft, drawing, put, way });
  const choose = useCallback((id: string) => setChosen({ kind: "box", id }), []);
  return (
    <Unread value={unread.tell}>
      <Head
        work={work}
        of={draft}
        put={(text) => put(change.setText(draft, text))}
        trouble={[...trouble, ...unanswered]}
        opened={() => go([])}
      >
        <button
          type="button"
          onClick={() =>
            void arrange(drawing).then((laid) => {
              const now = latest.current;
              if (now.way.join(".") !== way.join(".")) return;
              const there = new Set(now.drawing.boxes.map((box) => box.id));
              now.put(change.places(now.draft, Object.fromEntries([...laid].filter(([id]) => there.has(id)))));
              showAnew();
            })
          }
        >
          {tr("flow.arrange")}
        </button>
        <button
          type="button"
          aria-pressed={isBySource}
          onClick={() => {
            setBySource(!isBySource);
            showAnew();
          }}
        >
          {tr("flow.bySource")}
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
              {tr("flow.dataFlow")}
            </button>
            <button type="button" aria-pressed={shown === "lists"} onClick={() => setShown("lists")}>
              {tr("flow.commandLists")}
            </button>
          </>
        )}
        <Where whole={whole} way={way} go={go} />
      </Head>
      <Palette
        faces={faces}
        graphs={graphs}
        add={(block) => {
          add(block, freePlace(draft));
          showAnew();
        }}
        addGraph={addGraph}
      />
      {shown === "lists" && draft.kind === "verb" ? (
        <VerbStates draft={draft} findings={findings} chosen={presentList} choose={setList} put={put} />
      ) : (
        <ReactFlowProvider>
          <Canvas
            drawing={drawing}
            places={places}
            chosen={chosen}
            choose={setChosen}
            of={`${draft.kind} ${way.join("/")} ${shownAnew}`}
            move={move}
            edit={edit}
            aim={aim?.box ? aim : null}
            toggle={enter}
            elsewhere={elsewhere}
            regions={bySource?.regions}
          >
            {offer && (
              <div
                className="offer-at"
                style={{ left: `min(${offer.seen.x}px, 100% - 300px)`, top: `min(${offer.seen.y}px, 100% - 280px)` }}
              >
                <Offer
                  draft={draft}
                  faces={faces}
                  graphs={graphs}
                  from={offer.from}
                  take={(taken) => {
                    const made = withOffered(draft, offer.from, taken, offer.at, faces);
                    setOffer(null);
                    if (!made) return;
                    put(made.draft);
                    choose(made.box);
                  }}
                  close={() => setOffer(null)}
                />
              </div>
            )}
          </Canvas>
        </ReactFlowProvider>
      )}
      <div className="side stack">
        <Checks of={all} unread={unread.fields} isEmpty={Object.keys(draft.of.blocks).length === 0} aim={aimAt} />
        {chosen?.kind === "box" && Object.hasOwn(draft.of.blocks, chosen.id) && (
          <BoxPanel
            draft={draft}
            label={chosen.id}
            faces={faces}
            change={put}
            choose={choose}
            offer={(from) => setOffer({ from, at: besideOf(draft, from), seen: BY_KEYBOARD })}
            enter={enter}
            graphs={names}
            sources={sources}
            source={sourceOf(chosen.id)}
            runOn={(source) => runOn(chosen.id, source)}
          />
        )}
        {chosen?.kind === "box" && <BoundaryPanel draft={draft} box={chosen.id} put={put} choose={choose} />}
        {chosen?.kind === "wire" && (
          <WirePanel draft={draft} wire={drawing.wires.find((wire) => wire.id === chosen.id)} put={put} choose={choose} />
        )}
        {presentList !== null && shown === "lists" && draft.kind === "verb" && (
          <ListPanel draft={draft} list={presentList} findings={findings} change={put} choose={setList} />
        )}
        {draft.kind === "verb" && <VerbPanel draft={draft} faces={faces} device_types={device_types} findings={findings} change={put} />}
        {way.length === 0 && <Install draft={whole} placement={placement} faces={faces} isSound={isSound} />}
      </div>
    </Unread>
  );
}

/** The command lists of a verb as states. Drawing an arrow between two states adds a transition. */
function VerbStates(props: {
  draft: VerbDraft;
  findings: Finding[];
  chosen: string | null;
  choose: (list: string | null) => void;
  put: (draft: Draft) => void;
}) {
  const { draft, findings, chosen, choose, put } = props;
  const shape = useMemo(() => shapeOfDefinition(draft.of), [draft.of]);
  const edit = useMemo((): StateEdit => {
    const { layout, conditions, transitions } = draft.of;
    const own = Object.entries(layout).filter(([what]) => what.startsWith("list:"));
    const condition = Object.keys(conditions)[0] ?? "completed";
    return {
      chosen,
      choose,
      places: Object.fromEntries(own.map(([what, at]) => [what.slice("list:".length), at])),
      move: (name, to) => put(change.place(draft, `list:${name}`, to)),
      connect: (from, to) => put(change.setTransition(draft, transitions.length, { from, condition, to })),
      found: (name) => ofList(findings, name).map(about),
      isWrong: (from, to) =>
        transitions.some((line) => line.from === from && line.to === to && ofTransition(findings, from, line.condition).length > 0),
    };
  }, [draft, findings, chosen, choose, put]);
  return shape && <StatesCanvas shape={shape} edit={edit} />;
}

/** Returns the graphs of the file and the draft that can be used as blocks, and the names of all graphs. A graph cannot contain itself. */
function useGraphs(work: Working, whole: Draft, way: Way): { graphs: Graph[]; names: string[] } {
  const { file } = work;
  const ofFile = useMemo(() => (file ? definitionsOf(file.text).filter((one) => one.kind === "graph") : []), [file]);
  return useMemo(() => {
    const known = new Map<string, Graph>(ofFile.map(({ of }) => [of.name, of]));
    for (const [name, graph] of graphsWithin(whole)) known.set(name, graph);
    const around = new Set(way.map((_, depth) => within(whole, way.slice(0, depth + 1))?.of.name));
    if (whole.kind === "graph") around.add(whole.of.name);
    const isAround = (graph: Graph) => [graph.name, ...graphsWithin({ of: graph }).keys()].some((name) => around.has(name));
    return { graphs: [...known.values()].filter((graph) => !isAround(graph)), names: [...known.keys(), whole.of.name] };
  }, [ofFile, whole, way]);
}

/** Colours the boxes of blocks by the sources on which they are placed. */
function coloured(drawing: Drawing, sourceOf: (label: string) => string | null): Drawing {
  return { ...drawing, boxes: drawing.boxes.map((box) => (box.kind === "boundary" ? box : { ...box, source: sourceOf(box.id) })) };
}

/** Returns the reason why two ports cannot be wired. An unbound boundary accepts any type, because it has no type of its own. */
function whyNot(draft: Draft, possible: Possible, from: End, to: End): string | null {
  if ([from, to].some((end) => boundaryOf(draft, end.box)?.ports.length === 0)) return null;
  return possible.reason(placeOf(draft, from), placeOf(draft, to));
}

/** Returns a position next to a box, on the same side as the port. */
function besideOf(draft: Draft, from: WireStart): Place {
  const at = own(draft.of.layout, from.box);
  return at ? { x: at.x + (from.side === "output" ? 260 : -260), y: at.y } : freePlace(draft);
}
