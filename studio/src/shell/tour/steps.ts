// SPDX-License-Identifier: Apache-2.0
// Steps of the tour: what to press, where, and how the page notices that it was done.
import type { Report, Statistics } from "../../control/shapes";
import { tr } from "../../language/text";
import { addressOf } from "../route";

/** State of the system and of the page, from which the completion of a step is detected. */
export interface Observation {
  now: Statistics;
  /** Reports of the starts that have ended since the step began. */
  reports: readonly Report[];
  view: string;
  /** True if an emergency stop has been latched since the step began. */
  wasStopped: boolean;
}

export interface TourStep {
  title: string;
  /** Description of the control to press. */
  about: string;
  /** View with the control, and the text of the link to it; null if the control is visible everywhere. */
  link: { text: string; address: string } | null;
  isDone: (seen: Observation) => boolean;
}

/** Returns the five steps of the tour for an arm with these joints. */
export function stepsOf(joints: readonly string[]): TourStep[] {
  const joint = joints[0] ?? "";
  const devices = { text: tr("tour.openDevices"), address: addressOf("devices", [joint]) };
  const ended = (verbs: readonly string[]) => (seen: Observation) => seen.reports.some((report) => verbs.includes(report.verb));
  return [
    {
      title: tr("tour.enableTheArm"),
      about: tr("tour.pressEnableAll"),
      link: devices,
      isDone: ({ now }) => joints.every((one) => now.devices[one] === "standstill" || now.devices[one] === "moving"),
    },
    {
      title: tr("tour.jogAJoint"),
      about: tr("tour.holdPlusOrMinus"),
      link: devices,
      isDone: ended(["jog", "jog_linear"]),
    },
    {
      title: tr("tour.watchAValue"),
      about: tr("tour.theScopeShowsEachValue", { name: `${joint}.sensed` }),
      link: { text: tr("tour.openScope"), address: addressOf("scope", [], { names: `${joint}.sensed` }) },
      isDone: ({ view }) => view === "scope",
    },
    {
      title: tr("tour.moveToAPosition"),
      about: tr("tour.pressPresentChangeAValue"),
      link: { text: tr("tour.openVerbs"), address: addressOf("verbs", ["move_absolute"]) },
      isDone: (seen) => seen.reports.some((report) => report.verb === "move_absolute" && report.normal),
    },
    {
      title: tr("tour.stopAndReset"),
      about: tr("tour.pressEmergencyStopThenReset"),
      link: null,
      isDone: ({ now, wasStopped }) => wasStopped && now.emergency === null,
    },
  ];
}
