// SPDX-License-Identifier: Apache-2.0

import { Panel as Corner } from "@xyflow/react";
import { type KeyboardEvent, useEffect, useMemo, useRef, useState } from "react";
import { score } from "../../../design/fuzzy";
import { tr } from "../../../language/text";
import type { Drawing, Place, Selection } from "./drawing";
import { useMiddle } from "./Middle";

/** Object that can be found in a drawing: a box, a port of a box, or a cell. */
export interface Findable {
  text: string;
  /** Kind of the object: "gain", "port", "cell", … */
  about: string;
  /** Box to be shown; for a wire, the box at its start. */
  box: string;
  chosen: NonNullable<Selection>;
  /** Key of the object; the same whether the object is drawn or inside a closed graph. */
  key: string;
  /** Location of an object that is not drawn, and a function that opens it. */
  within?: { text: string; open: () => void };
}

/**
 * Objects that are not drawn because they are in closed or enclosing graphs, or in hidden instances. They are listed only during a
 * search.
 */
export interface Elsewhere {
  /** Mark that distinguishes the drawing's own objects from those with the same name elsewhere. */
  here: string;
  list: () => Findable[];
}

/**
 * Returns the objects that match `typed`, best first: labels, blocks, ports, SVVs and cells. Among equal matches, drawn objects come
 * first.
 */
export function foundIn(of: readonly Findable[], typed: string): Findable[] {
  if (typed.trim() === "") return [];
  const scored = of.flatMap((one) => {
    const [own, beside] = [score(typed, one.text), one.chosen.kind === "box" ? score(typed, one.about) : null];
    return own === null && beside === null ? [] : [{ one, score: own ?? (beside ?? 0) - 1000 }];
  });
  return scored.sort((a, b) => b.score - a.score).map(({ one }) => one);
}

/** Returns the objects of a drawing that can be found; `here` distinguishes them from objects with the same name elsewhere. */
export function findables(drawing: Drawing, here = ""): Findable[] {
  const named = (text: string, about: string, box: string, chosen: NonNullable<Selection>): Findable => ({
    text,
    about,
    box,
    chosen,
    key: `${here}\n${chosen.kind} ${chosen.id}\n${text}`,
  });
  const boxes = drawing.boxes.flatMap((box) => {
    const chosen = { kind: "box" as const, id: box.id };
    const ports = box.kind === "block" || box.kind === "graph" ? box.ports : [];
    return [
      named(box.title, box.about, box.id, chosen),
      ...ports.map((port) => named(`${box.title}.${port.name}`, port.side, box.id, chosen)),
    ];
  });
  const titles = new Set(boxes.map(({ text }) => text));
  const cells = new Map<string, Findable>();
  for (const wire of drawing.wires)
    if (!titles.has(wire.cell) && !cells.has(wire.cell) && wire.id !== "refused")
      cells.set(wire.cell, named(wire.cell, "cell", wire.from.box, { kind: "wire", id: wire.id }));
  return [...boxes, ...cells.values()];
}

/**
 * Searches the drawing and its closed graphs. Ctrl+F or `/` opens the search. Enter moves to the next match, Shift+Enter to the previous
 * one; the match is opened and centred.
 */
export function Find(props: {
  drawing: Drawing;
  places: ReadonlyMap<string, Place>;
  choose: (chosen: Selection) => void;
  elsewhere: Elsewhere | undefined;
}) {
  const { drawing, places, choose, elsewhere } = props;
  const show = useMiddle();
  const [isOpen, setOpen] = useState(false);
  const [typed, setTyped] = useState("");
  const [hit, setHit] = useState<Findable | null>(null);
  /** Object to be shown as soon as it is drawn. */
  const [awaited, setAwaited] = useState<Findable | null>(null);
  const field = useRef<HTMLInputElement>(null);
  const all = useMemo(() => {
    if (!isOpen) return [];
    const drawn = findables(drawing, elsewhere?.here);
    const known = new Set(drawn.map(({ key }) => key));
    return [...drawn, ...(elsewhere?.list() ?? []).filter(({ key }) => !known.has(key))];
  }, [isOpen, drawing, elsewhere]);
  const hits = useMemo(() => foundIn(all, typed), [all, typed]);
  const at = hit === null ? -1 : hits.findIndex(({ key }) => key === hit.key);
  useFindKeys(() => {
    setOpen(true);
    field.current?.select();
  });
  const step = (by: number) => {
    const next = hits[at < 0 ? (by > 0 ? 0 : hits.length - 1) : (at + by + hits.length) % hits.length];
    if (!next) return;
    setHit(next);
    setAwaited(next);
    next.within?.open();
  };
  useEffect(() => {
    const box = awaited && drawing.boxes.find((one) => one.id === awaited.box);
    const place = awaited && places.get(awaited.box);
    const isDrawn = awaited?.chosen.kind !== "wire" || drawing.wires.some(({ id }) => id === awaited.chosen.id);
    if (!awaited || !box || !place || !isDrawn || !findables(drawing, elsewhere?.here).some(({ key }) => key === awaited.key)) return;
    choose(awaited.chosen);
    return show(box, place, () => setAwaited(null));
  }, [awaited, drawing, places, elsewhere, choose, show]);
  const close = () => {
    setOpen(false);
    setTyped("");
    setHit(null);
    setAwaited(null);
  };
  const press = (event: KeyboardEvent) => {
    if (event.key === "Enter") step(event.shiftKey ? -1 : 1);
    else if (event.key === "Escape") close();
    else return;
    event.preventDefault();
  };
  return (
    <Corner position="top-right" className="find-corner">
      {isOpen ? (
        <search className="row">
          <input
            ref={field}
            // biome-ignore lint/a11y/noAutofocus: somebody has just asked for it
            autoFocus
            type="search"
            aria-label={tr("flow.findInTheDrawing")}
            placeholder={tr("flow.blockPortSVV")}
            value={typed}
            onChange={(event) => {
              setTyped(event.target.value);
              setHit(null);
              setAwaited(null);
            }}
            onKeyDown={press}
          />
          <span role="status" className="quiet small">
            {typed === ""
              ? ""
              : hits.length === 0
                ? tr("flow.noMatch")
                : hit && at >= 0
                  ? tr("flow.atOfCountText", {
                      at: at + 1,
                      count: hits.length,
                      text: hit.text,
                      part: hit.within ? tr("flow.inText", { text: hit.within.text }) : "",
                    })
                  : tr("flow.countFound", { count: hits.length })}
          </span>
          <button type="button" disabled={hits.length === 0} onClick={() => step(-1)} aria-label={tr("flow.previousMatch")}>
            ↑
          </button>
          <button type="button" disabled={hits.length === 0} onClick={() => step(1)} aria-label={tr("flow.nextMatch")}>
            ↓
          </button>
          <button type="button" onClick={close} aria-label={tr("flow.closeFind")}>
            ×
          </button>
        </search>
      ) : (
        <button type="button" onClick={() => setOpen(true)} title={tr("flow.ctrlFOr")}>
          {tr("flow.find")}
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
