// SPDX-License-Identifier: Apache-2.0
// The workspaces of the system: their list, one of them, and its problems in this system.
import { useCallback, useEffect, useState } from "react";
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
    let over = false;
    control.look("workspace", { name }).then(
      (workspace) => {
        if (over) return;
        setFound({ key, workspace });
        setRefusals([]);
      },
      (why) => over || setRefusals(refusalsOf(why)),
    );
    return () => {
      over = true;
    };
  }, [control, key, name]);
  return { workspace: found?.key === key ? found.workspace : null, refusals };
}

/** Returns the errors of a workspace in this system; it is checked again when it changes. */
export function useFindings(workspace: Workspace | null): Refusal[] {
  const control = useLive();
  const [found, setFound] = useState<Refusal[]>([]);
  const asked = workspace ? JSON.stringify(workspace) : "";
  useEffect(() => {
    let over = false;
    if (asked === "") return setFound([]);
    control.look("check_workspace", JSON.parse(asked) as Workspace).then(
      (wrong) => over || setFound(wrong as Refusal[]),
      (why) => over || setFound(refusalsOf(why)),
    );
    return () => {
      over = true;
    };
  }, [control, asked]);
  return found;
}
