// SPDX-License-Identifier: Apache-2.0

import { type ComponentType, type LazyExoticComponent, lazy } from "react";
import { tr } from "../language/text";

/** A view of the studio, loaded when it is first opened, or soon after the page. */
export interface View {
  name: string;
  title: string;
  /** Description of the view, for the tooltip. */
  about: string;
  /** True if the view is shown without the navigation bar and is not listed in it. */
  alone?: boolean;
  part: LazyExoticComponent<ComponentType>;
  /** Fetches the view, if that has not been done yet. */
  load: () => Promise<unknown>;
}

function loaded(load: () => Promise<{ default: ComponentType }>): Pick<View, "part" | "load"> {
  return { part: lazy(load), load };
}

export const views: View[] = [
  {
    name: "start",
    title: tr("shell.start"),
    about: tr("shell.overviewRunningInstancesFirstSteps"),
    ...loaded(() => import("../views/start")),
  },
  {
    name: "system",
    title: tr("shell.system"),
    about: tr("shell.processorsInterruptSourcesLoadJitterRights"),
    ...loaded(() => import("../views/system")),
  },
  {
    name: "flow",
    title: tr("shell.dataFlow"),
    about: tr("shell.theInstalledGraphsWithLiveValues"),
    ...loaded(() => import("../views/flow")),
  },
  {
    name: "verbs",
    title: tr("shell.verbs"),
    about: tr("shell.verbsAndTheirInstancesStartHalt"),
    ...loaded(() => import("../views/verbs")),
  },
  {
    name: "devices",
    title: tr("shell.devices"),
    about: tr("shell.logicalAndPhysicalDevicesTheArm"),
    ...loaded(() => import("../views/devices")),
  },
  { name: "scope", title: tr("shell.scope"), about: tr("shell.valuesAtTheirFullRate"), ...loaded(() => import("../views/scope")) },
  {
    name: "log",
    title: tr("shell.log"),
    about: tr("shell.conditionsFaultsTransitionsReportsCommands"),
    ...loaded(() => import("../views/log")),
  },
  {
    name: "recordings",
    title: tr("shell.recordings"),
    about: tr("shell.recordAllValuesToAFile"),
    ...loaded(() => import("../views/recordings")),
  },
  {
    name: "workspaces",
    title: tr("shell.workspaces"),
    about: tr("shell.layoutsOfPlotsValuesMachinesAlarms"),
    ...loaded(() => import("../views/workspaces")),
  },
  {
    name: "panel",
    title: tr("shell.panel"),
    about: tr("shell.aWorkspaceForOperators"),
    alone: true,
    ...loaded(() => import("../views/panel")),
  },
];

/** Fetches all views one after the other, so that each can also be opened later, without a connection. */
export async function fetchViews(): Promise<void> {
  for (const { load } of views) {
    try {
      await load();
    } catch {
      // The view says so when it is opened.
    }
  }
}
