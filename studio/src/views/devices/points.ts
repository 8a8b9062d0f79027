// SPDX-License-Identifier: Apache-2.0
// Taught points: the pose of a point with the present frames and tool, and a new point from the present pose of the arm.

import type { Refusal } from "../../control/refusals";
import type {
  ArmDescription,
  ChainDescription,
  NamedFrame,
  Report,
  TaughtPoint,
  TaughtPointRequest,
  TaughtPoints,
  Value,
} from "../../control/shapes";
import { tr } from "../../language/text";
import { configurationOf } from "./configuration";
import { SPEED_MAX, TURN_MAX } from "./toolJog";
import { apart, composed, inverse, numbersOf, type Pose, poseOf, poseOfTurns, rollPitchYaw, toolPose, type Vector } from "./toolPose";

/** First the frame name of a point that consists of joint positions, and then the name of the frame of the arm's poses. */
export const JOINTS = "joints";
export const WORLD = "world";
/**
 * Tolerance (m, rad) between the tool's pose at the taught joints and the pose of the point; if the difference is smaller, the taught
 * joints are used.
 */
const SAME = 1e-8;
const DEGREES = 180 / Math.PI;
const NOWHERE: Pose = poseOf([0, 0, 0, 1, 0, 0, 0]);

export interface PointGoal {
  /** Pose of the arm's current tool, in the frame of the arm's poses. */
  pose: Pose;
  /**
   * Joint positions; null if the frame or tool has changed since the point was taught, so that the positions would have to be computed.
   */
  joints: number[] | null;
}

/** Returns the goal of a point with the current frames and tools; null if its frame or tool does not exist. */
export function goalOf(points: TaughtPoints, point: TaughtPoint, chain: ChainDescription): PointGoal | null {
  const there = toolPose(chain, point.joints);
  if (point.position === null) return { pose: there, joints: point.joints };
  const frame = frameOf(points.frames, point.frame);
  const tool = point.tool === null ? undefined : frameOf(points.tools, point.tool);
  if (!frame || tool === null) return null;
  let pose = composed(frame, poseOfTurns(point.position, radians(point.rpy_deg ?? [0, 0, 0])));
  if (tool) pose = composed(composed(pose, inverse(tool)), poseOf(chain.tool));
  const [distance, angle] = apart(there, pose);
  return { pose, joints: distance < SAME && angle < SAME ? point.joints : null };
}

/**
 * Returns a point taught at the joint positions `q`. `frame` is `joints`, `world` or a work frame; `tool` is a tool of the file, or null
 * for the arm's tool.
 */
export function taughtAt(
  points: TaughtPoints,
  chain: ChainDescription,
  q: number[],
  name: string,
  frame: string,
  tool: string | null,
): TaughtPointRequest {
  const before = points.points.find((point) => point.name === name);
  const kept = { name, joints: q, note: before?.note ?? "" };
  if (frame === JOINTS) return { ...kept, frame };
  const within = frameOf(points.frames, frame) ?? NOWHERE;
  const of = tool === null ? undefined : frameOf(points.tools, tool);
  const flange = composed(toolPose(chain, q), inverse(poseOf(chain.tool)));
  const place = composed(inverse(within), composed(flange, of ?? poseOf(chain.tool)));
  const rpy_deg = rollPitchYaw(place).map((angle) => angle * DEGREES) as Vector;
  return { ...kept, frame, tool, position: place.place, rpy_deg, ...configurationOf(chain, q) };
}

function frameOf(of: readonly NamedFrame[], name: string): Pose | null {
  if (name === WORLD) return NOWHERE;
  const found = of.find((one) => one.name === name);
  return found ? poseOfTurns(found.position, radians(found.rpy_deg)) : null;
}

function radians(degrees: readonly number[]): Vector {
  return degrees.map((angle) => angle / DEGREES) as Vector;
}

export type Way = "joints" | "line";

/**
 * Returns the verb and the inputs of a motion to a point, at `share` % of the maximum speed; null if the motion needs joint positions
 * that are unknown.
 */
export function motionTo(
  goal: PointGoal,
  way: Way,
  share: number,
  chain: ChainDescription,
): { verb: string; values: Record<string, Value> } | null {
  if (way === "joints") return goal.joints && { verb: "move_absolute", values: { goal: goal.joints, speed: `${share} %` } };
  const speeds = { speed: (SPEED_MAX * share) / 100, angular_speed: (TURN_MAX * share) / 100 };
  return { verb: "move_linear", values: { pose: numbersOf(goal.pose), ...speeds, chain: { ...chain } } };
}

/** Returns a message about a motion that did not reach its point; null if it did. */
export function toldOfMotion(arm: ArmDescription, name: string, report: Report): Refusal | null {
  const { condition, value } = report;
  const refused = (message: string, remedy: string): Refusal => ({ class: condition, message, remedy });
  switch (condition) {
    case "arrived":
      return null;
    case "halted":
    case "stopped":
      return refused(tr("devices.theMotionToNameWasStopped", { name }), tr("devices.repeatItOrJog"));
    case "unreachable":
      return refused(tr("devices.nameCannotBeReachedInA", { name }), tr("devices.moveJointsOrTeachItAgain"));
    case "limit":
      return refused(
        tr("devices.onTheLineToNameJoint", { name, part: (typeof value === "number" && arm.joints[value]) || String(value) }),
        tr("devices.moveJointsOrStartFromAnother"),
      );
    case "singular":
      return refused(tr("devices.theLineToNamePassesNear", { name }), tr("devices.moveJointsOrStartFromAnother"));
    default:
      return refused(report.message || tr("devices.theMotionToNameEnded", { name }), tr("devices.seeTheLog"));
  }
}
