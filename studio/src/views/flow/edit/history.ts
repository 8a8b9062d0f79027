// SPDX-License-Identifier: Apache-2.0
import { useCallback, useEffect, useReducer } from "react";
import { type ComposedDefinition, type DrawnDefinition, newVerb } from "./definition";
import { followed, type Placement } from "./placement";
import { compositionOf, draftOf } from "./reading";

/**
 * Storage key of the draft: in session storage for the draft of this tab, and in local storage for the latest draft of any tab, with
 * which a new tab starts.
 */
const KEY = "opengpac.draft";
/** Storage key of the text of an unreadable draft, kept until the person saves or discards it. */
const UNREAD = "opengpac.draft.unread";
/** Maximum number of undo steps. */
const KEPT_MAX = 200;

const NOWHERE: Placement = {};

/** The opened file from which the draft was read, including its other content. */
export interface OpenedFile {
  name: string;
  text: string;
}

/** State of the editor: the draft, the file from which it was read, and the sources of its blocks. */
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

/**
 * Returns the history after a step. A change without effect does not add a step; opening another draft can be undone like any other
 * change.
 */
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

/** Sets the placement. An empty placement is removed, so that the work compares equal to its original state. */
function withPlacement(work: Work, placement: Placement): Work {
  const { placement: _before, ...rest } = work;
  return Object.keys(placement).length === 0 ? rest : { ...rest, placement };
}

function isSame(one: DrawnDefinition, other: DrawnDefinition): boolean {
  return one === other || JSON.stringify(one) === JSON.stringify(other);
}

/** Returns the draft with undo and redo. Each tab stores its own draft, which is restored when the page is reloaded. */
export function useDraft() {
  const [history, step] = useReducer(stepped, null, begun);
  const work = history.present;
  useEffect(() => {
    const text = JSON.stringify({ ...work.draft, file: work.file, placement: work.placement });
    try {
      sessionStorage.setItem(KEY, text);
      localStorage.setItem(KEY, text);
    } catch {
      // The browser's storage is full: the draft lasts as long as the page.
    }
  }, [work]);
  return {
    draft: work.draft,
    file: work.file,
    placement: work.placement ?? NOWHERE,
    placeOn: useCallback((on: Placement) => step({ on }), []),
    change: useCallback((to: DrawnDefinition) => step({ to }), []),
    /** Replaces the draft with one that has positions, without an undo step. */
    place: useCallback((placed: DrawnDefinition) => step({ placed }), []),
    open: useCallback((draft: DrawnDefinition, file: OpenedFile | null = null) => step({ instead: { draft, file } }), []),
    back: history.past.length > 0 ? () => step({ back: true }) : null,
    again: history.future.length > 0 ? () => step({ again: true }) : null,
  };
}

function begun(): History {
  return { past: [], present: kept() ?? { draft: newVerb("untitled"), file: null }, future: [] };
}

/** Returns the text of the stored draft, unparsed. */
export function keptText(): string | null {
  return sessionStorage.getItem(KEY) ?? localStorage.getItem(KEY);
}

/** Deletes the stored draft, so that the next page starts with an empty one. */
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
    // Damaged, or from another version of the page: the text is offered as a file.
    localStorage.setItem(UNREAD, text);
    return null;
  }
}

/** Validates a stored draft in the same way as a draft from a file. */
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
