// SPDX-License-Identifier: Apache-2.0
// Motions of an arm's tool requested by a button, and messages about their ends.

import type { Refusal } from "../../control/refusals";
import type { ArmDescription, ChainDescription, Report } from "../../control/shapes";
import { tr } from "../../language/text";
import { JOG_TOOL, type JogMotion } from "./jogging";
import { movingJoints } from "./toolPose";

/** Maximum speeds of the tool: m/s along an axis, rad/s about an axis. They equal the limits of the verb. */
export const SPEED_MAX = 0.25;
export const TURN_MAX = 1;
/** Number of joints required to move a tool along and about all axes. */
const AXES = 6;

/** Axes of the tool, as labelled on its buttons: translations, then rotations. */
export const TOOL_AXES = ["X", "Y", "Z", "RX", "RY", "RZ"] as const;
export type ToolAxis = (typeof TOOL_AXES)[number];

/** Step lengths, mm or degrees. 0 means no step: the tool moves while the button is held. */
export const STEPS = [0, 0.1, 1, 10] as const;
export type Step = (typeof STEPS)[number];

export interface ToolJog {
  axis: ToolAxis;
  direction: 1 | -1;
  /** Percentage of the maximum speed. */
  share: number;
  inTool: boolean;
  step: Step;
}

export function isTurn(axis: ToolAxis): boolean {
  return axis.startsWith("R");
}

/** Returns the reason why the tool of an arm cannot be jogged, as text; null if it can. */
export function whyNot(arm: ArmDescription): string | null {
  if (arm.chain === null) return tr("devices.theGeometryOfThisArmIs", { part: arm.missing || tr("devices.noProgramHasProvidedIt") });
  const joints = movingJoints(arm.chain);
  if (joints < AXES) return tr("devices.thisArmHasItsToolJogging", { part: tr("devices.countJointsThatMove", { count: joints }), AXES });
  return null;
}

/** Returns the motion for one press of a jog button. `chain` is the arm's current geometry, including its tool. */
export function toolMotion(arm: ArmDescription, chain: ChainDescription, jog: ToolJog): JogMotion {
  const turns = isTurn(jog.axis);
  const speeds = (of: boolean, most: number) =>
    TOOL_AXES.filter((axis) => isTurn(axis) === of).map((axis) => (axis === jog.axis ? (jog.direction * most * jog.share) / 100 : 0));
  const step = turns ? (jog.step * Math.PI) / 180 : jog.step / 1000;
  return {
    verb: JOG_TOOL,
    devices: arm.joints,
    isStep: jog.step > 0,
    values: {
      velocity: speeds(false, SPEED_MAX),
      angular_velocity: speeds(true, TURN_MAX),
      in_tool: jog.inTool,
      distance: step,
      chain: { ...chain },
    },
  };
}

/** Returns a single message for all joints that are not enabled. */
export function notEnabled(joints: readonly string[]): Refusal {
  const which = tr("devices.countJointsOfThisArmAre", { joints: joints[0], count: joints.length });
  return { class: "NotEnabled", message: tr("devices.whichNotEnabledSoNothingHas", { which }), remedy: tr("devices.pressEnableAllAbove") };
}

/** Returns a message about a motion of the tool that ended by itself, if the person must be informed; null if it ended as intended. */
export function toldOfEnd(arm: ArmDescription, report: Report): Refusal | null {
  const { condition } = report;
  if (condition === "arrived") return null;
  if (condition === "blocked") {
    const joint = typeof report.value === "number" && report.value >= 0 ? arm.joints[report.value] : undefined;
    return joint === undefined
      ? {
          class: "JogBlocked",
          message: tr("devices.theToolHasStoppedTheArm"),
          remedy: tr("devices.jogInAnotherDirectionOrMove"),
        }
      : {
          class: "JogBlocked",
          message: tr("devices.theToolHasStoppedJointJoint", { joint }),
          remedy: tr("devices.jogBackOrMoveThatJoint"),
        };
  }
  // The verb stopped the tool because the page's heartbeat was missing.
  if (condition === "stopped")
    return {
      class: "Released",
      message: tr("devices.theToolWasStoppedTheSystem"),
      remedy: tr("devices.pressAgain"),
    };
  return { class: condition, message: report.message || tr("devices.theMotionEnded"), remedy: tr("devices.seeTheLog") };
}
