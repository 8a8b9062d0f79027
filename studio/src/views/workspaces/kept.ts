// SPDX-License-Identifier: Apache-2.0
// The workspaces of the system: their list, one of them, and its problems in this system.
import { useCallback, useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { Workspace, WorkspaceAbout } from "../../control/shapes";
import { useLive, useWatched } from "../../shell/context";

/** Interval at which the list of workspaces is read, ms, because others may change their workspaces. */
const LOOK_MS = 2000;

/** Returns all workspaces of the system; null until they are known. */
export function useWorkspaces(): { all: WorkspaceAbout[] | null; refusals: Refusal[]; look: () => Promise<void> } {
  const control = useLive();
  const restarts = useWatched(control.restarts);
  const [all, setAll] = useState<WorkspaceAbout[] | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const look = useCallback(async () => {
    try {
      const found = await control.look("workspaces", {});
      setAll((before) => (JSON.stringify(before) === JSON.stringify(found) ? before : found));
      setRefusals([]);
    } catch (why) {
      setRefusals(refusalsOf(why));
    }
  }, [control]);
  // biome-ignore lint/correctness/useExhaustiveDependencies: a restart says when to ask again
  useEffect(() => {
    void look();
    const again = setInterval(() => void look(), LOOK_MS);
    return () => clearInterval(again);
  }, [look, restarts]);
  return { all, refusals, look };
}

/** Returns a workspace of the system; it is read again when its revision changes. */
export function useWorkspace(about: WorkspaceAbout | null): { workspace: Workspace | null; refusals: Refusal[] } {
  const control = useLive();
  const [found, setFound] = useState<{ key: string; workspace: Workspace } | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const key = about ? `${about.name} ${about.revision}` : "";
  const name = about?.name ?? null;
  useEffect(() => {
    if (name === null) return;
    return askUntilAnswered(control, {
      ask: (signal) => control.look("workspace", { name }, signal),
      take: (workspace) => {
        setFound({ key, workspace });
        setRefusals([]);
      },
      failed: (why) => setRefusals(refusalsOf(why)),
    });
  }, [control, key, name]);
  return { workspace: found?.key === key ? found.workspace : null, refusals };
}

/** Returns the errors of a workspace in this system; it is checked again when it changes. */
export function useFindings(workspace: Workspace | null): Refusal[] {
  const control = useLive();
  const [found, setFound] = useState<Refusal[]>([]);
  const asked = workspace ? JSON.stringify(workspace) : "";
  useEffect(() => {
    if (asked === "") return setFound([]);
    return askUntilAnswered(control, {
      ask: (signal) => control.look("check_workspace", JSON.parse(asked) as Workspace, signal),
      take: (wrong) => setFound(wrong as Refusal[]),
      failed: (why) => setFound(refusalsOf(why)),
    });
  }, [control, asked]);
  return found;
}
