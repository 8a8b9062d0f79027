// SPDX-License-Identifier: Apache-2.0
import { lazy, Suspense, useState } from "react";
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
          Installed
        </button>
        <button type="button" aria-pressed={editing} onClick={() => setEditing(true)}>
          Edit
        </button>
        {editing && !control.may("configure") && (
          <span className="quiet">
            Your role is {control.role}: you can draw, check and save. To install, open the studio with edit=True.
          </span>
        )}
      </div>
      {editing ? (
        <Suspense fallback={<p className="quiet">Loading…</p>}>
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
