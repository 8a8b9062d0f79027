// SPDX-License-Identifier: Apache-2.0

import { useCallback, useState } from "react";
import { Separator, type TabDropTarget, type TabNode, type TabsetNode, useWorkspaceRef, Workspace } from "react-resizable-panels";
import type { Region } from "../../control/shapes";
import { Empty } from "../../design/parts";
import { tr, trWord } from "../../language/text";
import { freshId, headingOf, layoutOf, modelOf, NOTHING, tabsetsOf } from "./layout";
import { PanelBody } from "./PanelBody";
import { PanelForm } from "./PanelForm";

/** Panel being composed: a new panel at a position, or an existing one. */
type ComposedPanel = { of: Region | null; target: TabDropTarget | null; id: string | null };

/** Docked panels, which can be dragged by their tabs and resized at their dividers, with the mouse or the keyboard. */
export function Dock(props: { layout: Region | null; workspace: string; editing: boolean; changed: (layout: Region | null) => void }) {
  const { workspace, editing, changed } = props;
  const dock = useWorkspaceRef<Region>();
  const [composed, setComposed] = useState<ComposedPanel | null>(null);
  const content = useCallback((tab: TabNode<Region>) => <PanelBody of={tab.data} workspace={workspace} />, [workspace]);

  const put = (panel: Region) => {
    const made = dock.current;
    if (!made || !composed) return;
    const title = headingOf(panel);
    if (composed.id !== null) made.updateTab(composed.id, { title, data: panel });
    else made.addTab({ id: freshId(made.getModel()), title, data: panel }, composed.target ? { target: composed.target } : {});
    setComposed(null);
  };

  return (
    <>
      {editing && (
        <div className="row">
          <button type="button" onClick={() => setComposed({ of: null, target: null, id: null })}>
            {tr("workspaces.addPanel")}
          </button>
          <span className="quiet small">{tr("workspaces.dragAPanelByItsHeading")}</span>
        </div>
      )}
      {editing && composed && (
        <PanelForm key={composed.id ?? JSON.stringify(composed.target)} of={composed.of} done={put} cancel={() => setComposed(null)} />
      )}
      <Workspace<Region>
        className="dock"
        workspaceRef={dock}
        defaultModel={props.layout ? modelOf(props.layout) : { version: 1, root: NOTHING }}
        disabled={!editing}
        hiddenTabBehavior="unmount"
        tabsetMinWidth="120px"
        tabsetMinHeight="60px"
        classNames={{
          tabset: "docked panel",
          header: "docked-header",
          tabList: "docked-tabs",
          tab: "docked-tab",
          tabPanels: "docked-panels",
          tabContent: "docked-content",
          toolbar: "docked-tools",
          dropIndicator: "docked-drop",
          dragPreview: "docked-drag",
        }}
        onModelChanged={(model, { reason }) => editing && reason !== "select" && changed(layoutOf(model))}
        renderTab={(tab, given) => (
          <div {...given} title={tab.title}>
            {tab.title}
          </div>
        )}
        renderTabContent={content}
        renderSeparator={(orientation) => (
          <Separator
            className={`docked-separator ${orientation}`}
            aria-label={
              orientation === "horizontal" ? tr("workspaces.widthOfThePanelsBesideIt") : tr("workspaces.heightOfThePanelsAboveAnd")
            }
          />
        )}
        renderEmptyTabset={() => (
          <Empty title={tr("workspaces.noPanelsYet")}>
            {editing ? tr("workspaces.addOneWithAddPanel") : tr("workspaces.pressEditToAddPanelsTo")}
          </Empty>
        )}
        renderTabsetToolbar={(tabset) =>
          editing && tabset.tabs.length > 0 ? (
            <TabsetTools
              of={tabset}
              others={() => (dock.current ? tabsetsOf(dock.current.getModel().root) : [])}
              compose={(target) => setComposed({ of: null, target, id: null })}
              edit={(tab) => setComposed({ of: tab.data, target: null, id: tab.id })}
              move={(tab, target) => dock.current?.moveTab(tab.id, target)}
              remove={(tab) => dock.current?.closeTab(tab.id)}
            />
          ) : null
        }
      />
    </>
  );
}

const SIDES = ["right", "bottom", "left", "top"] as const;
const SAID = {
  right: tr("workspaces.rightOfIt"),
  bottom: tr("workspaces.belowIt"),
  left: tr("workspaces.leftOfIt"),
  top: tr("workspaces.aboveIt"),
  center: tr("workspaces.asATab"),
};

/** Actions on the visible panel of a tabset: split, edit, move, remove. */
function TabsetTools(props: {
  of: TabsetNode<Region>;
  others: () => TabsetNode<Region>[];
  compose: (target: TabDropTarget) => void;
  edit: (tab: TabNode<Region>) => void;
  move: (tab: TabNode<Region>, target: TabDropTarget) => void;
  remove: (tab: TabNode<Region>) => void;
}) {
  const { of } = props;
  const tab = of.tabs.find((one) => one.id === of.selectedId) ?? of.tabs[0];
  if (!tab) return null;
  const name = tab.title ?? tab.id;
  const places = props.others().filter((other) => other.id !== of.id || of.tabs.length > 1);
  const act = (chosen: string) => {
    const target = JSON.parse(chosen) as TabDropTarget;
    props.move(tab, target);
  };
  return (
    <>
      <select
        aria-label={tr("workspaces.splitBesideName", { name })}
        value=""
        onChange={(event) => props.compose({ tabsetId: of.id, region: event.target.value as (typeof SIDES)[number] | "center" })}
      >
        <option value="">{tr("workspaces.split")}</option>
        {[...SIDES, "center" as const].map((region) => (
          <option key={region} value={region}>
            {tr("workspaces.aNewPanelSAID", { SAID: SAID[region] })}
          </option>
        ))}
      </select>
      <select aria-label={tr("workspaces.moveName", { name })} value="" onChange={(event) => act(event.target.value)}>
        <option value="">{tr("workspaces.move")}</option>
        {places.map((place) => (
          <optgroup key={place.id} label={place.tabs[0]?.title ?? tr("workspaces.emptyPlace")}>
            {[...SIDES, ...(place.id === of.id ? [] : ["center" as const])].map((region) => (
              <option key={region} value={JSON.stringify({ tabsetId: place.id, region })}>
                {SAID[region]}
              </option>
            ))}
          </optgroup>
        ))}
        <optgroup label={tr("workspaces.workspace")}>
          {SIDES.map((edge) => (
            <option key={edge} value={JSON.stringify({ edge })}>
              {tr("workspaces.toItsEdgeEdge", { edge: trWord(edge) })}
            </option>
          ))}
        </optgroup>
      </select>
      <button type="button" aria-label={tr("workspaces.editName", { name })} onClick={() => props.edit(tab)}>
        {tr("workspaces.edit")}
      </button>
      <button type="button" aria-label={tr("workspaces.removeName", { name })} onClick={() => props.remove(tab)}>
        {tr("workspaces.remove")}
      </button>
    </>
  );
}
