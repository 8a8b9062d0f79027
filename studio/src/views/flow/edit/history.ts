// SPDX-License-Identifier: Apache-2.0
import { useCallback, useEffect, useReducer } from "react";
import { type Draft, draftOf, newVerb } from "./definition";

const KEY = "opengpac.draft";
/** Changes that can be taken back. */
const KEPT_MAX = 200;

interface History {
  past: Draft[];
  present: Draft;
  future: Draft[];
}

type Step = { to: Draft } | { back: true } | { again: true } | { instead: Draft } | { placed: Draft };

function stepped(history: History, step: Step): History {
  const { past, present, future } = history;
  if ("to" in step) return step.to === present ? history : { past: [...past, present].slice(-KEPT_MAX), present: step.to, future: [] };
  if ("placed" in step) return { ...history, present: step.placed };
  if ("instead" in step) return { past: [], present: step.instead, future: [] };
  if ("back" in step) {
    const before = past.at(-1);
    return before ? { past: past.slice(0, -1), present: before, future: [present, ...future] } : history;
  }
  const [next, ...rest] = future;
  return next ? { past: [...past, present], present: next, future: rest } : history;
}

/** The draft with the way back. It is kept in the browser: a page that is loaded again has it. */
export function useDraft() {
  const [history, step] = useReducer(stepped, null, () => ({ past: [], present: kept() ?? newVerb("untitled"), future: [] }));
  const draft = history.present;
  useEffect(() => localStorage.setItem(KEY, JSON.stringify(draft)), [draft]);
  return {
    draft,
    change: useCallback((to: Draft) => step({ to }), []),
    /** The same with places: no change that could be taken back. */
    place: useCallback((placed: Draft) => step({ placed }), []),
    open: useCallback((instead: Draft) => step({ instead }), []),
    back: history.past.length > 0 ? () => step({ back: true }) : null,
    again: history.future.length > 0 ? () => step({ again: true }) : null,
  };
}

function kept(): Draft | null {
  try {
    const { kind, of } = JSON.parse(localStorage.getItem(KEY) ?? "null") as Draft;
    return draftOf(kind, of.name, of);
  } catch {
    // Nothing was kept, or by another version of the page: there is nothing that could be told about it.
    return null;
  }
}
