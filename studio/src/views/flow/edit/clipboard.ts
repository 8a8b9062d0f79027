// SPDX-License-Identifier: Apache-2.0
// Copied blocks with their constants and modes, and the cells between them. Names in use are replaced by free ones.
import { own } from "../../../design/own";
import type { Place } from "../drawing/drawing";
import { addBlock, allSets, freeName } from "./change";
import type { BlockUse, Draft, Mode, Sets } from "./definition";
import { splitPort } from "./faces";

/** Copied blocks, with their positions in the drawing. */
export interface Piece {
  blocks: Record<string, { use: BlockUse; at: Place }>;
  cells: Sets;
  modes: Record<string, Mode>;
}

/** Offset of a copy from its original, px. */
const BESIDE = 40;
/** Mark that distinguishes copied blocks from other text on the clipboard. */
const MARK = "opengpac-blocks";

/** Copies these blocks of a draft. */
export function copied(draft: Draft, labels: readonly string[]): Piece {
  const isOwn = (port: string) => labels.includes(splitPort(port, draft.of.blocks)[0]);
  const blocks = labels.flatMap((label) => {
    const use = own(draft.of.blocks, label);
    return use ? [[label, { use, at: own(draft.of.layout, label) ?? { x: 0, y: 0 } }] as const] : [];
  });
  const cells = Object.entries(draft.of.cells).map(([name, ports]) => [name, ports.filter(isOwn)] as const);
  return {
    blocks: Object.fromEntries(blocks),
    // A cell with only one of its ports in the piece is not copied.
    cells: Object.fromEntries(cells.filter(([, ports]) => ports.length > 1)),
    modes: Object.fromEntries(Object.entries(draft.of.modes ?? {}).filter(([port]) => isOwn(port))),
  };
}

/** Inserts the copied blocks at a small offset. Returns the new draft, and the labels of the inserted blocks. */
export function pasted(draft: Draft, piece: Piece): { draft: Draft; labels: string[] } {
  const names = new Map<string, string>();
  let next = draft;
  for (const [label, { use, at }] of Object.entries(piece.blocks)) {
    const made = addBlock(next, use, label, { x: at.x + BESIDE, y: at.y + BESIDE });
    names.set(label, made.label);
    next = made.draft;
  }
  const renamed = (port: string) => {
    const [label, rest] = splitPort(port, piece.blocks);
    return `${names.get(label) ?? label}.${rest}`;
  };
  const cells: Sets = { ...next.of.cells };
  for (const [name, ports] of Object.entries(piece.cells)) {
    const taken = [...allSets(next).map((set) => set.name), ...Object.keys(cells), ...Object.keys(next.of.blocks)];
    cells[freeName(name, taken)] = ports.map(renamed);
  }
  const added = Object.entries(piece.modes).map(([port, mode]) => [renamed(port), mode] as const);
  const modes = added.length > 0 ? { modes: { ...next.of.modes, ...Object.fromEntries(added) } } : {};
  return { draft: { ...next, of: { ...next.of, cells, ...modes } } as Draft, labels: [...names.values()] };
}

export function textOf(piece: Piece): string {
  return JSON.stringify({ [MARK]: 1, ...piece });
}

/** Parses copied blocks; returns null for other text. */
export function pieceOf(text: string): Piece | null {
  if (!text.startsWith(`{"${MARK}"`)) return null;
  try {
    const { blocks, cells, modes } = JSON.parse(text) as Piece;
    return { blocks, cells, modes };
  } catch {
    return null;
  }
}
