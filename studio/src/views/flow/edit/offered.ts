// SPDX-License-Identifier: Apache-2.0
// Targets for a wire that was dropped on the background: new blocks, existing ports, ports of the whole.

import { own } from "../../../design/own";
import { unitsAgree, unitText } from "../../../design/units";
import { tr } from "../../../language/text";
import type { End, Place, PortSide } from "../drawing/drawing";
import * as change from "./change";
import { type BlockUse, type Draft, definitionOf, type Graph, type SetKind } from "./definition";
import { boundaryOf, placeOf, portOf } from "./drawn";
import { type Faces, type Item, inner, itemsOf, modeText, sideOf } from "./faces";

/** A port as returned by `compatible`, and the reason why it cannot be the other end; null if it can. */
export interface PortAnswer {
  block: string;
  port: string;
  reason: string | null;
}

/** Start of the wire. */
export type WireStart = End & { side: PortSide };

export type WireOffer = { key: string; text: string; about: string } & (
  | { kind: "block"; use: BlockUse; name: string; port: string }
  | { kind: "port"; block: string; port: string }
  | { kind: "boundary"; set: SetKind; name: string }
);

/** The draft with one use of each block added, in order to query which ports can be connected, and the added uses by label. */
export interface TriedDraft {
  draft: Draft;
  uses: Map<string, { use: BlockUse; name: string }>;
}

export function tried(draft: Draft, faces: Faces, graphs: Iterable<Graph>): TriedDraft {
  const uses: TriedDraft["uses"] = new Map();
  const taken = new Set(Object.keys(draft.of.blocks));
  const add = (use: BlockUse, name: string) => {
    const label = change.freeName("new", taken);
    taken.add(label);
    uses.set(label, { use, name });
  };
  for (const face of faces.values()) add({ block: { subroutine: face.name }, constants: {} }, face.name);
  for (const graph of graphs) add({ block: { graph }, constants: {} }, graph.name);
  const blocks = { ...draft.of.blocks, ...Object.fromEntries([...uses].map(([label, { use }]) => [label, use])) };
  return { draft: { ...draft, of: { ...draft.of, blocks } } as Draft, uses };
}

/** Returns the query to send to the system; null if there is no port that could be queried, so that the answer is determined here. */
export function questionOf(draft: Draft, from: WireStart, at: TriedDraft): Record<string, unknown> | null {
  const boundary = boundaryOf(draft, from.box);
  if (boundary && (draft.kind === "verb" || boundary.ports.length === 0)) return null;
  return { [draft.kind]: definitionOf(at.draft), from: placeOf(draft, from) };
}

/**
 * Returns the ports that can be connected without querying the system: all ports for an unbound boundary, and ports of the same type for
 * a boundary of a verb.
 */
export function fitting(draft: Draft, from: WireStart, at: TriedDraft, faces: Faces): PortAnswer[] {
  const bound = boundaryOf(draft, from.box)
    ?.ports.map((port) => inner(draft.of, port, faces))
    .find((item) => item !== undefined);
  const fits = (item: Item) => !bound || (item.type_text === bound.type_text && unitsAgree(item.unit, bound.unit));
  return Object.entries(at.draft.of.blocks).flatMap(([block, use]) =>
    itemsOf(use, faces)
      .filter((item) => (item.kind === "input" || item.kind === "output") && item.kind !== from.side && fits(item))
      .map((item) => ({ block, port: item.name, reason: null })),
  );
}

/** Returns the offers: existing ports, then new blocks, then a new boundary. Blocks with the same unit and type come first. */
export function offered(draft: Draft, from: WireStart, at: TriedDraft, answered: PortAnswer[], faces: Faces): WireOffer[] {
  const begun = inner(draft.of, `${from.box}.${from.port}`, faces);
  const likeness = (item: Item | undefined) =>
    begun && item ? Number(begun.unit !== "" && begun.unit === item.unit) * 2 + Number(begun.type_text === item.type_text) : 0;
  const fits = answered.filter(({ block, port, reason }) => {
    const use = own(at.draft.of.blocks, block);
    const item = use && itemsOf(use, faces).find((one) => one.name === port);
    return reason === null && item !== undefined && sideOf(item) !== from.side;
  });
  const blocks = fits.flatMap(({ block, port }) => {
    const found = at.uses.get(block);
    const item = found && itemsOf(found.use, faces).find((one) => one.name === port);
    if (!found || !item) return [];
    const { use, name } = found;
    const about = `${item.type_text}${item.unit ? ` ${tr("flow.inUnit", { unit: unitText(item.unit) })}` : ""}, ${modeText(item.mode)}`;
    const text = `${name.replace(/^library\./, "")}.${port}`;
    return [
      {
        offer: { kind: "block" as const, key: tr("flow.newNamePort", { name, port }), text, about, use, name, port },
        likeness: likeness(item),
      },
    ];
  });
  blocks.sort((one, other) => other.likeness - one.likeness);
  const ports = fits
    .filter(({ block }) => !at.uses.has(block))
    .map(({ block, port }) => ({
      kind: "port" as const,
      key: `${block}.${port}`,
      text: `${block}.${port}`,
      about: tr("flow.exists"),
      block,
      port,
    }));
  return [...ports, ...blocks.map(({ offer }) => offer), ...outside(draft, from)];
}

/** Returns the offer of a new boundary of the whole. */
function outside(draft: Draft, from: WireStart): WireOffer[] {
  if (boundaryOf(draft, from.box)) return [];
  const name = from.port.replaceAll(".", "_");
  if (draft.kind === "verb")
    return [
      {
        kind: "boundary",
        key: "parameter",
        text: tr("flow.newInstantiationParameter"),
        about: name,
        set: "instantiation_parameters",
        name,
      },
    ];
  const set = from.side === "output" ? "outputs" : "inputs";
  return [{ kind: "boundary", key: set, text: tr("flow.newOfTheGraph", { value: set.slice(0, -1) }), about: name, set, name }];
}

/** Applies an offer: returns the wired draft, and the box at the other end. */
export function withOffered(
  draft: Draft,
  from: WireStart,
  offer: WireOffer,
  at: Place,
  faces: Faces,
): { draft: Draft; box: string } | null {
  const begun = portOf(draft, from);
  if (begun === undefined) return null;
  const wired = (next: Draft, end: string | change.NamedSet) =>
    from.side === "output" ? change.connect(next, begun, end, faces) : change.connect(next, end, begun, faces);
  if (offer.kind === "port") return { draft: wired(draft, `${offer.block}.${offer.port}`), box: offer.block };
  if (offer.kind === "block") {
    const made = change.addBlock(draft, offer.use, offer.name.split(".").at(-1) ?? offer.name, at);
    return { draft: wired(made.draft, `${made.label}.${offer.port}`), box: made.label };
  }
  const made = change.addBoundary(draft, offer.set, offer.name, at);
  const set = change
    .allSets(made)
    .find((one) => one.kind === offer.set && !change.allSets(draft).some((old) => old.kind === one.kind && old.name === one.name));
  return set ? { draft: wired(made, set), box: `${set.kind}:${set.name}` } : null;
}
