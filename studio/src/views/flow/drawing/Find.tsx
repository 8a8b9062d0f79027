// SPDX-License-Identifier: Apache-2.0
import { Panel as Corner, useReactFlow, useStoreApi } from "@xyflow/react";
import { type KeyboardEvent, useEffect, useMemo, useRef, useState } from "react";
import { score } from "../../../design/fuzzy";
import { type Chosen, type Drawing, type Place, sizeOf } from "./drawing";

/** What can be found in a drawing: a box, a port of one, a cell. */
export interface Findable {
  text: string;
  /** "gain", "port", "cell", … */
  about: string;
  /** The box at which it is seen; of a wire, where it begins. */
  box: string;
  chosen: NonNullable<Chosen>;
}

/** What `typed` finds, the best first: labels, blocks, ports, SVVs and cells. */
export function foundIn(drawing: Drawing, typed: string): Findable[] {
  if (typed.trim() === "") return [];
  const scored = findables(drawing).flatMap((one) => {
    const [own, beside] = [score(typed, one.text), one.chosen.kind === "box" ? score(typed, one.about) : null];
    return own === null && beside === null ? [] : [{ one, score: own ?? (beside ?? 0) - 1000 }];
  });
  return scored.sort((a, b) => b.score - a.score).map(({ one }) => one);
}

function findables(drawing: Drawing): Findable[] {
  const boxes = drawing.boxes.flatMap((box) => {
    const chosen = { kind: "box" as const, id: box.id };
    const ports = box.kind === "block" || box.kind === "graph" ? box.ports : [];
    return [
      { text: box.title, about: box.about, box: box.id, chosen },
      ...ports.map((port) => ({ text: `${box.title}.${port.name}`, about: port.side, box: box.id, chosen })),
    ];
  });
  const titles = new Set(boxes.map(({ text }) => text));
  const cells = new Map<string, Findable>();
  for (const wire of drawing.wires)
    if (!titles.has(wire.cell) && !cells.has(wire.cell) && wire.id !== "refused")
      cells.set(wire.cell, { text: wire.cell, about: "cell", box: wire.from.box, chosen: { kind: "wire", id: wire.id } });
  return [...boxes, ...cells.values()];
}

/** How near a box is shown when it was found. */
const ZOOM_FOUND = 1;

/** Finds in the drawing. Ctrl+F or `/` opens it; Enter steps to the next, Shift+Enter to the one before, and shows it in the middle. */
export function Find(props: { drawing: Drawing; places: ReadonlyMap<string, Place>; choose: (chosen: Chosen) => void }) {
  const { drawing, places, choose } = props;
  const flow = useReactFlow();
  const store = useStoreApi();
  const [isOpen, setOpen] = useState(false);
  const [typed, setTyped] = useState("");
  const [at, setAt] = useState<number | null>(null);
  const field = useRef<HTMLInputElement>(null);
  const hits = useMemo(() => (isOpen ? foundIn(drawing, typed) : []), [isOpen, drawing, typed]);
  useFindKeys(() => {
    setOpen(true);
    field.current?.select();
  });
  const step = (by: number) => {
    if (hits.length === 0) return;
    const next = at === null ? (by > 0 ? 0 : hits.length - 1) : (at + by + hits.length) % hits.length;
    const hit = hits[next];
    setAt(next);
    if (!hit) return;
    choose(hit.chosen);
    const box = drawing.boxes.find((one) => one.id === hit.box);
    const place = places.get(hit.box);
    if (!box || !place) return;
    const { width, height } = sizeOf(box);
    const zoom = Math.max(store.getState().transform[2], ZOOM_FOUND);
    void flow.setCenter(place.x + width / 2, place.y + height / 2, { zoom });
  };
  const close = () => {
    setOpen(false);
    setTyped("");
    setAt(null);
  };
  const press = (event: KeyboardEvent) => {
    if (event.key === "Enter") step(event.shiftKey ? -1 : 1);
    else if (event.key === "Escape") close();
    else return;
    event.preventDefault();
  };
  const hit = at === null ? undefined : hits[at];
  return (
    <Corner position="top-right" className="find-corner">
      {isOpen ? (
        <search className="row">
          <input
            ref={field}
            // biome-ignore lint/a11y/noAutofocus: somebody has just asked for it
            autoFocus
            type="search"
            aria-label="Find in the drawing"
            placeholder="Block, port, SVV"
            value={typed}
            onChange={(event) => {
              setTyped(event.target.value);
              setAt(null);
            }}
            onKeyDown={press}
          />
          <span role="status" className="quiet small">
            {typed === ""
              ? ""
              : hits.length === 0
                ? "nothing found"
                : hit
                  ? `${(at ?? 0) + 1} of ${hits.length}: ${hit.text}`
                  : `${hits.length} found`}
          </span>
          <button type="button" disabled={hits.length === 0} onClick={() => step(-1)} aria-label="Found before">
            ↑
          </button>
          <button type="button" disabled={hits.length === 0} onClick={() => step(1)} aria-label="Found next">
            ↓
          </button>
          <button type="button" onClick={close} aria-label="Close find">
            ×
          </button>
        </search>
      ) : (
        <button type="button" onClick={() => setOpen(true)} title="Ctrl+F or /">
          Find
        </button>
      )}
    </Corner>
  );
}

function useFindKeys(open: () => void): void {
  const latest = useRef(open);
  latest.current = open;
  useEffect(() => {
    const press = (event: globalThis.KeyboardEvent) => {
      const isTyping = event.target instanceof HTMLElement && event.target.closest("input, select, textarea") !== null;
      const isFind = (event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "f";
      const isSlash = event.key === "/" && !isTyping && !event.ctrlKey && !event.metaKey && !event.altKey;
      if (!isFind && !isSlash) return;
      event.preventDefault();
      latest.current();
    };
    window.addEventListener("keydown", press);
    return () => window.removeEventListener("keydown", press);
  }, []);
}
