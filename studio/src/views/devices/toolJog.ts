// SPDX-License-Identifier: Apache-2.0
// Motions of an arm's tool requested by a button, and messages about their ends.
import type { Refusal } from "../../control/refusals";
import type { ArmDescription, ChainDescription, Report } from "../../control/shapes";
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
  if (arm.chain === null)
    return `The geometry of this arm is unknown: ${arm.missing || "no program has provided it"}. Jog its joints instead.`;
  const joints = movingJoints(arm.chain);
  if (joints < AXES)
    return `This arm has ${joints === 1 ? "1 joint that moves" : `${joints} joints that move`} its tool; jogging it along and about all axes requires ${AXES}. Jog its joints instead.`;
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
  const which = joints.length === 1 ? `Joint '${joints[0]}' is` : `${joints.length} joints of this arm are`;
  return { class: "NotEnabled", message: `${which} not enabled, so nothing has moved.`, remedy: "press Enable all above" };
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
          message: "The tool has stopped: the arm is near a singularity or at the end of its reach.",
          remedy: "jog in another direction, or move a joint",
        }
      : {
          class: "JogBlocked",
          message: `The tool has stopped: joint '${joint}' is at the end of its range.`,
          remedy: "jog back, or move that joint alone",
        };
  }
  // The verb stopped the tool because the page's heartbeat was missing.
  if (condition === "stopped")
    return {
      class: "Released",
      message: "The tool was stopped: the system received nothing from this page for 0.25 s.",
      remedy: "press again",
    };
  return { class: condition, message: report.message || "The motion ended.", remedy: "see the log" };
}
