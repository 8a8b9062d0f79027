// SPDX-License-Identifier: Apache-2.0
import { useCallback, useEffect, useReducer } from "react";
import { type ComposedDefinition, type DrawnDefinition, newVerb } from "./definition";
import { followed, type Placement } from "./placement";
import { compositionOf, draftOf } from "./reading";

/** The draft of this tab, and that which was changed last in any: a new tab begins with a copy of it. */
const KEY = "opengpac.draft";
/** A draft that could not be read: its text, until somebody has saved it or put it away. */
const UNREAD = "opengpac.draft.unread";
/** Changes that can be taken back. */
const KEPT_MAX = 200;

const NOWHERE: Placement = {};

/** A file that was opened: what the draft came from, and what else it has. */
export interface OpenedFile {
  name: string;
  text: string;
}

/** Work of the editor: the drawing, the file that it came from, and the sources on which its blocks are to run. */
export interface Work {
  draft: DrawnDefinition;
  file: OpenedFile | null;
  placement?: Placement;
}

export interface History {
  past: Work[];
  present: Work;
  future: Work[];
}

export type Step =
  | { to: DrawnDefinition }
  | { back: true }
  | { again: true }
  | { instead: Work }
  | { placed: DrawnDefinition }
  | { on: Placement };

/** A change that changes nothing is none; opening another draft can be taken back as every change. */
export function stepped(history: History, step: Step): History {
  const { past, present, future } = history;
  const onto = (next: Work): History => ({ past: [...past, present].slice(-KEPT_MAX), present: next, future: [] });
  if ("to" in step) return isSame(step.to, present.draft) ? history : onto(changed(present, step.to));
  if ("on" in step)
    return JSON.stringify(step.on) === JSON.stringify(present.placement ?? {}) ? history : onto(withPlacement(present, step.on));
  if ("placed" in step) return { ...history, present: { ...present, draft: step.placed } };
  if ("instead" in step) return onto(step.instead);
  if ("back" in step) {
    const before = past.at(-1);
    return before ? { past: past.slice(0, -1), present: before, future: [present, ...future] } : history;
  }
  const [next, ...rest] = future;
  return next ? { past: [...past, present], present: next, future: rest } : history;
}

function changed(work: Work, draft: DrawnDefinition): Work {
  const next = { ...work, draft };
  return work.placement ? withPlacement(next, followed(work.placement, work.draft, draft)) : next;
}

/** A work in which nothing is placed has no placement: so it is as it was before. */
function withPlacement(work: Work, placement: Placement): Work {
  const { placement: _before, ...rest } = work;
  return Object.keys(placement).length === 0 ? rest : { ...rest, placement };
}

function isSame(one: DrawnDefinition, other: DrawnDefinition): boolean {
  return one === other || JSON.stringify(one) === JSON.stringify(other);
}

/** The draft with the way back. It is kept for this tab: a page that is loaded again has it, another tab has its own. */
export function useDraft() {
  const [history, step] = useReducer(stepped, null, begun);
  const work = history.present;
  useEffect(() => {
    const text = JSON.stringify({ ...work.draft, file: work.file, placement: work.placement });
    try {
      sessionStorage.setItem(KEY, text);
      localStorage.setItem(KEY, text);
    } catch {
      // The browser has no room for it: it stays while the page is open.
    }
  }, [work]);
  return {
    draft: work.draft,
    file: work.file,
    placement: work.placement ?? NOWHERE,
    placeOn: useCallback((on: Placement) => step({ on }), []),
    change: useCallback((to: DrawnDefinition) => step({ to }), []),
    /** The same with places: no change that could be taken back. */
    place: useCallback((placed: DrawnDefinition) => step({ placed }), []),
    open: useCallback((draft: DrawnDefinition, file: OpenedFile | null = null) => step({ instead: { draft, file } }), []),
    back: history.past.length > 0 ? () => step({ back: true }) : null,
    again: history.future.length > 0 ? () => step({ again: true }) : null,
  };
}

function begun(): History {
  return { past: [], present: kept() ?? { draft: newVerb("untitled"), file: null }, future: [] };
}

/** The text of the draft that is kept, as it is. */
export function keptText(): string | null {
  return sessionStorage.getItem(KEY) ?? localStorage.getItem(KEY);
}

/** Begins afresh the next time; what was kept is gone. */
export function forgetKept(): void {
  sessionStorage.removeItem(KEY);
  localStorage.removeItem(KEY);
}

export function unreadText(): string | null {
  return localStorage.getItem(UNREAD);
}

export function forgetUnread(): void {
  localStorage.removeItem(UNREAD);
}

function kept(): Work | null {
  const text = keptText();
  if (text === null) return null;
  try {
    const { file, placement, ...draft } = JSON.parse(text) as DrawnDefinition & { file?: OpenedFile | null; placement?: Placement };
    return withPlacement({ draft: checked(draft as DrawnDefinition), file: file ?? null }, placement ?? {});
  } catch {
    // By another version of the page, or damaged: it is offered as a file.
    localStorage.setItem(UNREAD, text);
    return null;
  }
}

/** A draft that was kept, read as a file is. */
function checked(draft: DrawnDefinition): DrawnDefinition {
  if (draft.kind !== "composition") return draftOf(draft.kind, draft.of.name, draft.of);
  const parts = Object.entries(draft.made_of ?? {}).map(([name, part]): [string, ComposedDefinition["made_of"][string]] => [
    name,
    part.kind === "composition"
      ? { kind: "composition", of: compositionOf(name, part.of) }
      : (draftOf("verb", name, part.of) as ComposedDefinition["made_of"][string]),
  ]);
  return { kind: "composition", of: compositionOf(draft.of.name, draft.of), made_of: Object.fromEntries(parts) };
}
