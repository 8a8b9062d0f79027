// SPDX-License-Identifier: Apache-2.0

import { type ComponentType, type LazyExoticComponent, lazy } from "react";
import { tr } from "../language/text";

/** A view of the studio, loaded when it is first opened. */
export interface View {
  name: string;
  title: string;
  /** Description of the view, for the tooltip. */
  about: string;
  /** True if the view is shown without the navigation bar and is not listed in it. */
  alone?: boolean;
  part: LazyExoticComponent<ComponentType>;
}

export const views: View[] = [
  {
    name: "start",
    title: tr("shell.start"),
    about: tr("shell.overviewRunningInstancesFirstSteps"),
    part: lazy(() => import("../views/start")),
  },
  {
    name: "system",
    title: tr("shell.system"),
    about: tr("shell.processorsInterruptSourcesLoadJitterRights"),
    part: lazy(() => import("../views/system")),
  },
  {
    name: "flow",
    title: tr("shell.dataFlow"),
    about: tr("shell.theInstalledGraphsWithLiveValues"),
    part: lazy(() => import("../views/flow")),
  },
  {
    name: "verbs",
    title: tr("shell.verbs"),
    about: tr("shell.verbsAndTheirInstancesStartHalt"),
    part: lazy(() => import("../views/verbs")),
  },
  {
    name: "devices",
    title: tr("shell.devices"),
    about: tr("shell.logicalAndPhysicalDevicesTheArm"),
    part: lazy(() => import("../views/devices")),
  },
  { name: "scope", title: tr("shell.scope"), about: tr("shell.valuesAtTheirFullRate"), part: lazy(() => import("../views/scope")) },
  {
    name: "log",
    title: tr("shell.log"),
    about: tr("shell.conditionsFaultsTransitionsReportsCommands"),
    part: lazy(() => import("../views/log")),
  },
  {
    name: "recordings",
    title: tr("shell.recordings"),
    about: tr("shell.recordAllValuesToAFile"),
    part: lazy(() => import("../views/recordings")),
  },
  {
    name: "workspaces",
    title: tr("shell.workspaces"),
    about: tr("shell.layoutsOfPlotsValuesMachinesAlarms"),
    part: lazy(() => import("../views/workspaces")),
  },
  {
    name: "panel",
    title: tr("shell.panel"),
    about: tr("shell.aWorkspaceForOperators"),
    alone: true,
    part: lazy(() => import("../views/panel")),
  },
];
