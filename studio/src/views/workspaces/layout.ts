// SPDX-License-Identifier: Apache-2.0
// A layout in the form of files, and in that of the docking library. Files have shares of rows and columns, as a person writes them; the
// library has percentages, with an identity for each panel.

import type {
  TabNode,
  TabsetNode,
  TabsetNodeInput,
  WorkspaceModel,
  WorkspaceModelInput,
  WorkspaceNode,
  WorkspaceNodeInput,
} from "react-resizable-panels";
import type { PanelKind, Region } from "../../control/shapes";
import { tr } from "../../language/text";

export const KINDS: readonly PanelKind[] = ["plot", "scene", "values", "verb", "alarms", "buttons"];

const WORDS: Record<PanelKind, string> = {
  plot: tr("workspaces.plot"),
  scene: tr("workspaces.machine"),
  values: tr("workspaces.values"),
  verb: tr("workspaces.verb"),
  alarms: tr("workspaces.alarms"),
  buttons: tr("workspaces.buttons"),
};

/** Returns the name of a kind of panel. */
export function kindWord(kind: PanelKind): string {
  return WORDS[kind];
}

/** Returns the heading of a panel. */
export function headingOf(panel: Region): string {
  if (panel.title) return panel.title;
  const kind = panel.panel ?? "alarms";
  const of = panel.names?.[0] ?? panel.device ?? panel.verb;
  return of ? `${kindWord(kind)} ${of}` : kindWord(kind);
}

/** Returns the regions inside a region, and their arrangement. */
export function innerOf(of: Region): { regions: readonly Region[]; side: "row" | "column" | "tabs" } {
  if (of.row && of.row.length > 0) return { regions: of.row, side: "row" };
  if (of.column && of.column.length > 0) return { regions: of.column, side: "column" };
  return { regions: of.tabs ?? [], side: "tabs" };
}

/** Returns all panels in order. */
export function panelsOf(of: Region): Region[] {
  return of.panel ? [of] : innerOf(of).regions.flatMap(panelsOf);
}

/** Returns a panel without its share. */
function alone(of: Region): Region {
  const { share: _, ...panel } = of;
  return panel;
}

/** Converts a layout to a model of the docking library. A layout without panels becomes an empty tabset. */
export function modelOf(layout: Region): WorkspaceModelInput<Region> {
  let last = 0;
  const tab = (of: Region): TabNode<Region> => {
    last += 1;
    return { id: `panel-${last}`, title: headingOf(of), data: alone(of) };
  };
  const node = (of: Region): WorkspaceNodeInput<Region> => {
    const { regions, side } = innerOf(of);
    if (of.panel) return { type: "tabset", tabs: [tab(of)] };
    if (side === "tabs") return { type: "tabset", tabs: regions.map(tab) };
    const whole = regions.reduce((sum, region) => sum + (region.share ?? 1), 0);
    const children = regions.map((region) => ({ ...node(region), size: (100 * (region.share ?? 1)) / whole }));
    return { type: "split", orientation: side === "row" ? "horizontal" : "vertical", children };
  };
  return { version: 1, root: node(layout) };
}

/** Converts a model of the docking library to a layout; returns null if no panel is left. */
export function layoutOf(model: WorkspaceModel<Region>): Region | null {
  return regionOf(model.root);
}

function regionOf(node: WorkspaceNode<Region>): Region | null {
  if (node.type === "tabset") {
    const panels = node.tabs.map((one) => alone(one.data));
    return panels.length > 1 ? { tabs: panels } : (panels[0] ?? null);
  }
  const kept = node.children.flatMap((child) => {
    const region = regionOf(child);
    return region ? [{ region, size: percentOf(child.size) }] : [];
  });
  const [first] = kept;
  if (!first) return null;
  if (kept.length === 1) return first.region;
  const shares = sharesOf(kept.map((one) => one.size));
  const regions = kept.map(({ region }, index) => (shares ? { share: shares[index], ...region } : region)) as Region[];
  return node.orientation === "horizontal" ? { row: regions } : { column: regions };
}

function percentOf(size: number | string | undefined): number | null {
  const read = typeof size === "string" ? Number.parseFloat(size) : size;
  return read === undefined || !Number.isFinite(read) ? null : read;
}

/** Returns shares relative to an equal share, to two digits; null if all are equal. Regions without a size share the rest equally. */
export function sharesOf(percents: readonly (number | null)[]): number[] | null {
  const given = percents.filter((size) => size !== null);
  const left = Math.max(0, 100 - given.reduce((sum, size) => sum + size, 0));
  const open = percents.length - given.length;
  const shares = percents.map((size) => {
    const share = ((size ?? left / Math.max(1, open)) * percents.length) / 100;
    return Math.max(0.01, Math.round(share * 100) / 100);
  });
  return shares.every((share) => Math.abs(share - (shares[0] ?? 1)) < 0.015) ? null : shares;
}

/** Returns all tabsets of a model in order. */
export function tabsetsOf(node: WorkspaceNode<Region>): TabsetNode<Region>[] {
  return node.type === "tabset" ? [node] : node.children.flatMap(tabsetsOf);
}

/** An empty model. */
export const NOTHING: TabsetNodeInput<Region> = { type: "tabset", tabs: [] };

/** Returns a new id for a panel of this model. */
export function freshId(model: WorkspaceModel<Region>): string {
  const used = new Set(tabsetsOf(model.root).flatMap((tabset) => tabset.tabs.map((one) => one.id)));
  let number = used.size + 1;
  while (used.has(`panel-${number}`)) number += 1;
  return `panel-${number}`;
}
