// SPDX-License-Identifier: Apache-2.0
import { type ComponentType, type LazyExoticComponent, lazy } from "react";

/** A view of the studio, loaded when it is first opened. */
export interface View {
  name: string;
  title: string;
  /** Description of the view, for the tooltip. */
  about: string;
  /** True if the view is shown without the navigation, and not listed there. */
  alone?: boolean;
  part: LazyExoticComponent<ComponentType>;
}

export const views: View[] = [
  { name: "start", title: "Start", about: "overview, running instances, first steps", part: lazy(() => import("../views/start")) },
  {
    name: "system",
    title: "System",
    about: "processors, interrupt sources, load, jitter, rights",
    part: lazy(() => import("../views/system")),
  },
  { name: "flow", title: "Data flow", about: "the installed graphs, with live values", part: lazy(() => import("../views/flow")) },
  {
    name: "verbs",
    title: "Verbs",
    about: "verbs and their instances: start, halt, transitions",
    part: lazy(() => import("../views/verbs")),
  },
  {
    name: "devices",
    title: "Devices",
    about: "logical and physical devices, the arm in 3-D",
    part: lazy(() => import("../views/devices")),
  },
  { name: "scope", title: "Scope", about: "values at their full rate", part: lazy(() => import("../views/scope")) },
  { name: "log", title: "Log", about: "conditions, faults, transitions, reports, commands", part: lazy(() => import("../views/log")) },
  {
    name: "recordings",
    title: "Recordings",
    about: "record all values to a file",
    part: lazy(() => import("../views/recordings")),
  },
  {
    name: "workspaces",
    title: "Workspaces",
    about: "layouts of plots, values, machines, alarms and buttons",
    part: lazy(() => import("../views/workspaces")),
  },
  { name: "panel", title: "Panel", about: "a workspace for operators", alone: true, part: lazy(() => import("../views/panel")) },
];
