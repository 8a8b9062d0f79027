// SPDX-License-Identifier: Apache-2.0

import { ReactFlowProvider } from "@xyflow/react";
import { useCallback, useEffect, useMemo, useState } from "react";
import type { InstalledInstance } from "../../../control/shapes";
import { Empty, Refusals } from "../../../design/parts";
import { tr, trWord } from "../../../language/text";
import { useControl, useTopic, useWatched } from "../../../shell/context";
import { Canvas } from "../drawing/Canvas";
import type { Drawing, Place, Selection } from "../drawing/drawing";
import { arrange, arrangeIn } from "../drawing/layout";
import type { GroupedDrawing, Region } from "../drawing/regions";
import { sourceColour } from "../drawing/sources";
import { Details } from "./Details";
import { drawn, graphsOf } from "./drawn";
import { everythingIn, instanceOf } from "./elsewhere";
import { inOwnUnits } from "./units";

const NOTHING: Drawing = { boxes: [], wires: [] };

/** The data flow of installed instances, with live values. */
export function Installed() {
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const trouble = useWatched(control.topics.installed.trouble);
  const [said, setSaid] = useState<ReadonlySet<string> | null>(null);
  const [opened, setOpened] = useState<ReadonlySet<string>>(new Set());
  const [chosen, setChosen] = useState<Selection>(null);
  const instances = useMemo(() => (installed?.instances ?? []).filter((one) => one.state !== "deleted").map(inOwnUnits), [installed]);
  const toggle = useCallback((box: string) => setOpened((before) => toggled(before, box)), []);
  const first = useFirst(instances);
  const hidden = said ?? first;
  const shown = useMemo(() => instances.filter((one) => !hidden.has(one.name)), [instances, hidden]);
  const drawing = useDrawing(shown, opened);
  const [grouping, setGrouping] = useState<Grouping>(null);
  const arranged = useArranged(drawing, grouping);
  const { places, move } = useMoved(arranged);
  const show = useCallback(
    (instance: string, graphs: string[]) => {
      setSaid(new Set([...hidden].filter((name) => name !== instance)));
      setOpened((before) => (graphs.every((graph) => before.has(graph)) ? before : new Set([...before, ...graphs])));
    },
    [hidden],
  );
  const elsewhere = useMemo(() => ({ here: "", list: () => everythingIn(instances, show) }), [instances, show]);
  useEffect(() => {
    if (installed) control.values.renew();
  }, [control, installed]);

  if (trouble.length > 0) return <Refusals of={trouble} />;
  if (!installed) return <p className="quiet">{tr("flow.loadingTheInstalledGraphs")}</p>;
  if (instances.length === 0) {
    return <Empty title={tr("flow.nothingIsInstalled")}>{tr("flow.enableADeviceOrCreateAn")}</Empty>;
  }
  const graphs = shown.flatMap(graphsOf);
  return (
    <div className="flow">
      <div className="tools row">
        <Instances of={instances} hidden={hidden} set={setSaid} />
        {graphs.length > 0 && (
          <>
            <button type="button" onClick={() => setOpened(new Set(graphs))}>
              {tr("flow.openAllGraphs")}
            </button>
            <button type="button" onClick={() => setOpened(new Set())}>
              {tr("flow.closeAllGraphs")}
            </button>
          </>
        )}
        {GROUPINGS.map(({ by, text }) => (
          <button key={by} type="button" aria-pressed={grouping === by} onClick={() => setGrouping(grouping === by ? null : by)}>
            {text}
          </button>
        ))}
        <Sources of={drawing} />
      </div>
      {arranged ? (
        <ReactFlowProvider>
          <Canvas
            drawing={arranged.drawing}
            places={places}
            regions={arranged.regions}
            elsewhere={elsewhere}
            chosen={chosen}
            choose={setChosen}
            of={arranged.of}
            // Regions show where blocks run, and dragging an installed block does not move it to another source.
            move={grouping === null ? move : undefined}
            toggle={toggle}
          />
        </ReactFlowProvider>
      ) : (
        <p className="quiet">{tr("flow.layingOutCountBoxes", { count: drawing.boxes.length })}</p>
      )}
      <Details drawing={drawing} chosen={chosen} instances={shown} />
    </div>
  );
}

function Instances(props: { of: InstalledInstance[]; hidden: ReadonlySet<string>; set: (hidden: ReadonlySet<string>) => void }) {
  return (
    <fieldset className="row" aria-label={tr("flow.instancesShown")}>
      {props.of.map((instance) => (
        <label key={instance.id} className="row shown" title={instance.name}>
          <input
            type="checkbox"
            checked={!props.hidden.has(instance.name)}
            onChange={() => props.set(toggled(props.hidden, instance.name))}
          />
          <span className="name">{instance.name}</span>
          <span className="quiet">{trWord(instance.state)}</span>
        </label>
      ))}
    </fieldset>
  );
}

function Sources(props: { of: Drawing }) {
  const sources = [...new Set(props.of.boxes.map((box) => box.source).filter((source) => source !== null))];
  return (
    <ul className="row quiet" aria-label={tr("flow.interruptSourcesByColour")}>
      {sources.map((source) => (
        <li key={source} style={{ borderTop: `3px solid ${sourceColour(source)}` }}>
          {source}
        </li>
      ))}
    </ul>
  );
}

/** Maximum number of blocks shown initially, to keep the drawing comprehensible. */
const BLOCKS_FIRST = 20;

/**
 * Returns the instances that are hidden initially: those that are not running, and those that would exceed `BLOCKS_FIRST`. Instances
 * that act on devices are shown first.
 */
function useFirst(instances: InstalledInstance[]): ReadonlySet<string> {
  const [first, setFirst] = useState<ReadonlySet<string> | null>(null);
  const found = useMemo(() => firstHidden(instances), [instances]);
  // The shown instances do not change by themselves, except that new ones appear.
  if (first === null && instances.length > 0) setFirst(found);
  return first ?? found;
}

export function firstHidden(instances: InstalledInstance[]): ReadonlySet<string> {
  const hidden = new Set<string>();
  let blocks = 0;
  const actionsFirst = [...instances].sort((one, other) => Number(one.owner !== null) - Number(other.owner !== null));
  for (const instance of actionsFirst) {
    const isShown = instance.state === "running" && (blocks === 0 || blocks + instance.blocks.length <= BLOCKS_FIRST);
    if (isShown) blocks += instance.blocks.length;
    else hidden.add(instance.name);
  }
  return hidden.size === instances.length ? new Set() : hidden;
}

function toggled(of: ReadonlySet<string>, name: string): ReadonlySet<string> {
  const next = new Set(of);
  if (!next.delete(name)) next.add(name);
  return next;
}

/** Structure of a drawing. Instances with the same blocks and cells are drawn in the same way, regardless of their state. */
interface Form {
  names: string[];
  parts: unknown[];
  opened: ReadonlySet<string>;
}

function formOf(shown: InstalledInstance[], opened: ReadonlySet<string>): Form {
  return { names: shown.map(({ name }) => name), parts: shown.flatMap(({ blocks, cells }) => [blocks, cells]), opened };
}

function isSameForm(one: Form | null, other: Form): boolean {
  const same = (a: unknown[], b: unknown[]) => a.length === b.length && a.every((part, index) => part === b[index]);
  return one !== null && one.opened === other.opened && same(one.names, other.names) && same(one.parts, other.parts);
}

/** Returns the drawing, as the same object while it is unchanged, because states and lists change often, but boxes and wires rarely. */
function useDrawing(shown: InstalledInstance[], opened: ReadonlySet<string>): Drawing {
  const [kept, setKept] = useState<{ form: Form | null; text: string; drawing: Drawing }>({ form: null, text: "", drawing: NOTHING });
  const form = formOf(shown, opened);
  if (isSameForm(kept.form, form)) return kept.drawing;
  const next = drawn(shown, opened);
  // The running system reports all installed instances again with each change; equal reports give the same drawing.
  const text = JSON.stringify(next);
  const drawing = text === kept.text ? kept.drawing : next;
  setKept({ form, text, drawing });
  return drawing;
}

type Grouping = "source" | "instance" | null;
const GROUPINGS = [
  { by: "source", text: tr("flow.bySource") },
  { by: "instance", text: tr("flow.byInstance") },
] as const;
/** Region of SVVs and channels that do not belong to a single source or instance. */
const SHARED = "shared";

interface ArrangedDrawing {
  drawing: Drawing;
  places: ReadonlyMap<string, Place>;
  regions?: Region[];
  of: string;
}

/** Returns the positions, including those of moved boxes, as long as the same boxes are drawn. */
function useMoved(arranged: ArrangedDrawing | null): { places: ReadonlyMap<string, Place>; move: (box: string, to: Place) => void } {
  const [moved, setMoved] = useState<{ of: string; to: ReadonlyMap<string, Place> }>({ of: "", to: new Map() });
  const of = arranged?.of ?? "";
  const move = useCallback(
    (box: string, to: Place) => setMoved((before) => ({ of, to: new Map(before.of === of ? before.to : []).set(box, to) })),
    [of],
  );
  const places = useMemo(() => new Map([...(arranged?.places ?? []), ...(moved.of === of ? moved.to : [])]), [arranged, moved, of]);
  return { places, move };
}

/** Returns the drawing with positions for its boxes, and regions if requested; null until they are known. */
function useArranged(drawing: Drawing, grouping: Grouping): ArrangedDrawing | null {
  const [arranged, setArranged] = useState<ArrangedDrawing | null>(null);
  useEffect(() => {
    let over = false;
    const of = `${grouping}\n${drawing.boxes.map((box) => box.id).join("\n")}`;
    void inRegions(drawing, grouping).then(async (laid) => {
      const places = laid?.places ?? (await arrange(drawing));
      if (!over) setArranged({ drawing, places, of, ...(laid ? { regions: laid.regions } : {}) });
    });
    return () => {
      over = true;
    };
  }, [drawing, grouping]);
  return arranged;
}

async function inRegions(drawing: Drawing, grouping: Grouping): Promise<GroupedDrawing | null> {
  if (grouping === null) return null;
  if (grouping === "instance") return await arrangeIn(drawing, (box) => instanceOf(drawing, box.id) ?? SHARED);
  const laid = await arrangeIn(drawing, (box) => box.source ?? SHARED);
  return laid && { ...laid, regions: laid.regions.map((region) => ({ ...region, source: region.title === SHARED ? null : region.title })) };
}
