// SPDX-License-Identifier: Apache-2.0

import { useRef } from "react";
import type { Workspace } from "../../control/shapes";
import { Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useAction, useLive } from "../../shell/context";
import { go } from "../../shell/route";
import { fromFile } from "./file";
import { drafts } from "./Opened";

/** Opens a workspace from a file as a draft. If the system refuses its format, shows the refusals and does not open it. */
export function Import() {
  const control = useLive();
  const action = useAction();
  const input = useRef<HTMLInputElement>(null);
  const open = async (file: File) => {
    const workspace: Workspace = fromFile(await file.text());
    const wrong = await control.look("check_workspace", workspace);
    const form = wrong.filter((one) => one.class === "DefinitionError");
    if (form.length > 0) throw new Error(form.map((one) => `${one.message}; ${one.remedy}`).join(". "));
    drafts.set(workspace.name, workspace);
    go("workspaces", [workspace.name]);
  };
  return (
    <>
      <button type="button" onClick={() => input.current?.click()}>
        {tr("workspaces.openFile")}
      </button>
      <input
        ref={input}
        type="file"
        accept=".json"
        className="unseen"
        tabIndex={-1}
        aria-label={tr("workspaces.fileOfAWorkspace")}
        onChange={(event) => {
          const file = event.target.files?.[0];
          event.target.value = "";
          if (file) void action.run(() => open(file));
        }}
      />
      <Refusals of={action.refusals} />
    </>
  );
}
