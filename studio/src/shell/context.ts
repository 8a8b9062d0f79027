// SPDX-License-Identifier: Apache-2.0
import { createContext, useCallback, useContext, useState, useSyncExternalStore } from "react";
import type { Control } from "../control/control";
import { type Refusal, refusalsOf } from "../control/refusals";
import type { Source, Topic } from "../control/source";
import type { WatchedValue } from "../control/watched";

export const ControlContext = createContext<Control | null>(null);
export const SourceContext = createContext<Source | null>(null);

/** Returns the running system itself, for elements that all views share, and for actions. */
export function useLive(): Control {
  const control = useContext(ControlContext);
  if (!control) throw new Error("this part of the page has no connected system");
  return control;
}

/** Returns the source of the views: the running system, the paused system, or a recording. */
export function useControl(): Source {
  const source = useContext(SourceContext);
  if (!source) throw new Error("this part of the page has no connected system");
  return source;
}

/** Returns the current value of a watched value; the component is re-rendered when the value changes. */
export function useWatched<T>(watched: WatchedValue<T>): T {
  return useSyncExternalStore(watched.watch, watched.get);
}

/** Returns the latest value of a topic: statistics, installed instances, log, ends. */
export function useTopic<T>(shared: Topic<T>): T | null {
  return useSyncExternalStore(shared.watch, shared.get);
}

/** An action that a person starts, with its state (busy or not) and the refusals to be shown next to its button. */
export interface Action {
  busy: boolean;
  refusals: Refusal[];
  run: (action: () => Promise<unknown>) => Promise<boolean>;
  clear: () => void;
}

export function useAction(): Action {
  const [busy, setBusy] = useState(false);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const run = useCallback(async (action: () => Promise<unknown>) => {
    setBusy(true);
    setRefusals([]);
    try {
      await action();
      return true;
    } catch (why) {
      setRefusals(refusalsOf(why));
      return false;
    } finally {
      setBusy(false);
    }
  }, []);
  const clear = useCallback(() => setRefusals([]), []);
  return { busy, refusals, run, clear };
}
