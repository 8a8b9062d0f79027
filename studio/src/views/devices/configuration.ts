// SPDX-License-Identifier: Apache-2.0
// Configuration of an arm at given joint positions: signs of shoulder, elbow and wrist, and turns, as defined by gpac.Configuration.
import type { ChainDescription } from "../../control/shapes";
import { add, applied, composed, displacement, HINGE, type Pose, poseOf, subtract, type Vector, vector } from "./toolPose";

/** Arms with a closed-form solution have six revolute joints. */
const JOINTS = 6;
/** Tolerance for axes that intersect (m), or are parallel or perpendicular (sine). */
const EXACT = 1e-6;

interface Axis {
  /** Index of the joint in the chain. */
  joint: number;
  direction: Vector;
  point: Vector;
}

/** Axes of an arm that has configurations, and the intersections of the fifth axis with its neighbours. */
interface Axes {
  axes: Axis[];
  wrist: Vector;
  centre: Vector;
}

export interface ArmConfiguration {
  /** Signs of shoulder, elbow and wrist: "+-+". */
  configuration: string;
  turns: number[];
}

/** Returns the configuration of an arm at the joint positions `q`, rad; null if the arm has no configurations. */
export function configurationOf(chain: ChainDescription, q: readonly number[]): ArmConfiguration | null {
  const of = axesOf(chain);
  if (!of) return null;
  const angles = of.axes.map(({ joint }) => q[joint] ?? Number.NaN);
  if (!angles.every(Number.isFinite)) return null;
  return { configuration: signsOf(of, angles).map(sign).join(""), turns: angles.map(turnOf) };
}

/**
 * Returns the axes if the first is perpendicular to the second, the second parallel to the third, and the last three intersect in one
 * point, or the fourth is parallel to the third and the fifth intersects both its neighbours; otherwise null.
 */
function axesOf(chain: ChainDescription): Axes | null {
  const axes = Array.from({ length: chain.joints }, (_, joint) => joint)
    .filter((joint) => chain.kind[joint] !== 0)
    .map((joint) => ({ joint, direction: vector(chain.axis[joint]), point: vector(chain.anchor[joint]) }));
  if (axes.length !== JOINTS || axes.some(({ joint }) => chain.kind[joint] !== HINGE)) return null;
  const [first, second, third, fourth, fifth, sixth] = axes as [Axis, Axis, Axis, Axis, Axis, Axis];
  const [wrist, centre] = [meeting(fourth, fifth), meeting(fifth, sixth)];
  if (!wrist || !centre || Math.abs(dot(first.direction, second.direction)) > EXACT || !areParallel(second, third)) return null;
  return length(subtract(wrist, centre)) < EXACT || areParallel(third, fourth) ? { axes, wrist, centre } : null;
}

/** Returns three numbers with the signs of shoulder, elbow and wrist. */
function signsOf({ axes, wrist, centre }: Axes, angles: number[]): [number, number, number] {
  const moved: { direction: Vector; point: Vector }[] = [];
  const beyond: Pose[] = [];
  let pose = poseOf([]);
  for (const [index, { direction, point }] of axes.entries()) {
    moved.push({ direction: applied(pose.turn, direction), point: placed(pose, point) });
    pose = composed(pose, displacement(HINGE, direction, point, angles[index] ?? Number.NaN) as Pose);
    beyond.push(pose);
  }
  const [first, second, third, fourth, fifth, sixth] = moved as [Axis, Axis, Axis, Axis, Axis, Axis];
  const there = { wrist: placed(beyond[3] as Pose, wrist), centre: placed(beyond[4] as Pose, centre) };
  return [
    dot(cross(first.direction, second.direction), subtract(there.centre, first.point)),
    dot(cross(subtract(third.point, second.point), subtract(there.wrist, third.point)), second.direction),
    dot(cross(fourth.direction, sixth.direction), fifth.direction),
  ];
}

/** Returns the turn of a joint: 0 from -180 to 180 degrees; at the boundary of two turns the even one, as in Python. */
function turnOf(angle: number): number {
  const turns = angle / (2 * Math.PI);
  const nearest = Math.round(turns);
  // `Math.round` rounds a half up. A rounded small negative angle is -0.
  return (nearest - turns === 0.5 && nearest % 2 !== 0 ? nearest - 1 : nearest) + 0;
}

function sign(of: number): string {
  return of >= 0 ? "+" : "-";
}

/** Returns the intersection of two axes; null if they do not intersect. */
function meeting(one: Axis, other: Axis): Vector | null {
  const across = cross(one.direction, other.direction);
  const square = dot(across, across);
  const between = subtract(other.point, one.point);
  if (square < EXACT || Math.abs(dot(between, across)) > EXACT * Math.sqrt(square)) return null;
  const along = dot(cross(between, other.direction), across) / square;
  return one.point.map((x, index) => x + (one.direction[index] ?? 0) * along) as Vector;
}

function areParallel(one: Axis, other: Axis): boolean {
  return length(cross(one.direction, other.direction)) < EXACT;
}

function placed(pose: Pose, point: Vector): Vector {
  return add(applied(pose.turn, point), pose.place);
}

function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

function dot(a: Vector, b: Vector): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function length(a: Vector): number {
  return Math.hypot(...a);
}
