// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import type { Region, Workspace, WorkspaceAbout } from "../../control/shapes";
import { Empty, Refusals } from "../../design/parts";
import { saveText } from "../../design/saveText";
import { tr } from "../../language/text";
import { useAction, useLive } from "../../shell/context";
import { addressOf, go } from "../../shell/route";
import { Dock } from "./Dock";
import { Fixed } from "./Fixed";
import { fileName, fileText } from "./file";
import { useFindings, useWorkspace } from "./kept";
import { useIsNarrow } from "./narrow";

/** Workspaces that were composed on this page but have not been stored yet, by name; they survive a change of views. */
export const drafts = new Map<string, Workspace>();

/** A workspace with its panels, which can be composed. `about` is null if the system does not have a workspace with that name yet. */
export function Opened(props: { name: string; about: WorkspaceAbout | null; look: () => Promise<void> }) {
  const { name, about, look } = props;
  const control = useLive();
  const action = useAction();
  const isNarrow = useIsNarrow();
  const { workspace: kept, refusals } = useWorkspace(about);
  const [draft, setDraft] = useState<Workspace | null>(() => drafts.get(name) ?? null);
  const [editing, setEditing] = useState(about === null);
  const [as, setAs] = useState("");
  // The dock manages its own layout: another one is shown by remounting the dock, but never while a person composes.
  const [begun, setBegun] = useState(0);
  const [baseline, setBaseline] = useState<number | null>(about?.revision ?? null);
  useEffect(() => {
    if (draft === null) setBaseline(about?.revision ?? null);
  }, [about, draft]);
  const shown = draft ?? kept ?? (about === null ? { name, layout: {} } : null);
  const findings = useFindings(shown && hasPanels(shown.layout) ? shown : null);
  if (!shown) return refusals.length > 0 ? <Refusals of={refusals} /> : <p className="quiet wait">{tr("workspaces.loading")}</p>;

  const change = (of: Partial<Workspace>) => {
    const next = { ...shown, ...of };
    drafts.set(name, next);
    setDraft(next);
  };
  const changed = (layout: Region | null) => change({ layout: layout ?? {} });
  const keep = async (called: string) => {
    await control.aside("keep_workspace", { ...shown, name: called });
    drafts.delete(name);
    await look();
    setDraft(null);
    setEditing(false);
    setAs("");
    if (called !== name) go("workspaces", [called]);
  };
  const renew = () => {
    drafts.delete(name);
    setDraft(null);
    setBegun(begun + 1);
  };
  const isEmpty = !hasPanels(shown.layout);
  const may = control.may("operate");
  const overtaken = draft !== null && about !== null && baseline !== null && about.revision !== baseline;
  return (
    <>
      <div className="row workspace-tools" role="group" aria-label={tr("workspaces.workspaceName", { name })}>
        <h2>{shown.title || name}</h2>
        {/* As wide in either state, and each tool has its place in both: a change moves none of them. */}
        <span className="quiet kept">{draft || !about ? tr("workspaces.notSavedYet") : tr("workspaces.kept")}</span>
        <button type="button" aria-pressed={editing} disabled={isNarrow} onClick={() => setEditing(!editing)}>
          {tr("workspaces.edit")}
        </button>
        {editing && (
          <>
            <label>
              {tr("workspaces.title")}{" "}
              <input size={14} maxLength={100} value={shown.title ?? ""} onChange={(event) => change({ title: event.target.value })} />
            </label>
            <label>
              <input type="checkbox" checked={shown.operator ?? false} onChange={(event) => change({ operator: event.target.checked })} />{" "}
              {tr("workspaces.forOperators")}
            </label>
          </>
        )}
        {may && !about?.shipped && (
          <button
            type="button"
            className="primary"
            disabled={action.busy || !draft || isEmpty}
            onClick={() => action.run(() => keep(name))}
          >
            {tr("workspaces.save")}
          </button>
        )}
        {may && (
          <form
            className="row"
            onSubmit={(event) => {
              event.preventDefault();
              void action.run(() => keep(as.trim()));
            }}
          >
            <input
              aria-label={tr("workspaces.saveUnderAnotherName")}
              placeholder={tr("workspaces.anotherName")}
              size={12}
              maxLength={100}
              value={as}
              onChange={(event) => setAs(event.target.value)}
            />
            <button type="submit" disabled={action.busy || as.trim() === "" || isEmpty}>
              {tr("workspaces.saveAs")}
            </button>
          </form>
        )}
        {about && (
          <button type="button" disabled={!draft} onClick={renew}>
            {tr("workspaces.discardChanges")}
          </button>
        )}
        <button type="button" disabled={isEmpty} onClick={() => saveText(fileName(shown), "application/json", fileText(shown))}>
          {tr("workspaces.export")}
        </button>
        {about && !isEmpty && (
          <a className="button" href={addressOf("panel", [name])}>
            {tr("workspaces.openAsPanel")}
          </a>
        )}
        {may && about && !about.shipped && (
          <button
            type="button"
            disabled={action.busy}
            onClick={() =>
              action.run(async () => {
                await control.aside("forget_workspace", { name });
                drafts.delete(name);
                await look();
                go("workspaces");
              })
            }
          >
            {tr("workspaces.delete")}
          </button>
        )}
      </div>
      {shown.doc && <p className="quiet">{shown.doc}</p>}
      {overtaken && (
        <p className="notice warn" role="status">
          {tr("workspaces.somebodyElseHasSavedThisWorkspace")}
        </p>
      )}
      <Refusals of={[...action.refusals, ...refusals, ...findings]} />
      {isNarrow ? (
        isEmpty ? (
          <Empty title={tr("workspaces.noPanelsYet")}>{tr("workspaces.useAWiderScreenToAdd")}</Empty>
        ) : (
          <Fixed layout={shown.layout} workspace={name} />
        )
      ) : (
        <Dock key={`${begun} ${baseline}`} layout={isEmpty ? null : shown.layout} workspace={name} editing={editing} changed={changed} />
      )}
    </>
  );
}

function hasPanels(of: Region): boolean {
  return of.panel !== undefined && of.panel !== null ? true : [...(of.row ?? []), ...(of.column ?? []), ...(of.tabs ?? [])].some(hasPanels);
}
