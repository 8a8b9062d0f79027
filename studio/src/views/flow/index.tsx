// SPDX-License-Identifier: Apache-2.0

import { lazy, Suspense, useState } from "react";
import { tr } from "../../language/text";
import { useControl } from "../../shell/context";
import "./flow.css";
import { DraftBoundary } from "./edit/DraftBoundary";
import { Installed } from "./installed/Installed";

const Editor = lazy(() => import("./edit/Editor"));

/** Data flow view: shows the installed instances or, on request, the editor. */
export default function View() {
  const control = useControl();
  const [editing, setEditing] = useState(false);
  return (
    <div className="stack">
      <div className="row">
        <button type="button" aria-pressed={!editing} onClick={() => setEditing(false)}>
          {tr("flow.installed2")}
        </button>
        <button type="button" aria-pressed={editing} onClick={() => setEditing(true)}>
          {tr("flow.edit")}
        </button>
        {editing && !control.may("configure") && <span className="quiet">{tr("flow.yourRoleIsRoleYouCan", { role: control.role })}</span>}
      </div>
      {editing ? (
        <Suspense fallback={<p className="quiet">{tr("flow.loading")}</p>}>
          <DraftBoundary>
            <Editor />
          </DraftBoundary>
        </Suspense>
      ) : (
        <Installed />
      )}
    </div>
  );
}
