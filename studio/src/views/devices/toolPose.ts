// SPDX-License-Identifier: Apache-2.0
// Tool pose of an arm at given joint positions, as a product of exponentials like in the kinematic blocks.
import type { ChainDescription } from "../../control/shapes";

export type Vector = [number, number, number];
/** Rotation matrix, in row-major order. */
type Turn = [Vector, Vector, Vector];

/** Position (m) and orientation in a frame. */
export interface Pose {
  place: Vector;
  turn: Turn;
}

/** Kinds of joints in a chain. */
export const HINGE = 1;
const SLIDE = 2;
/** Sine of the minimum angle from a pitch of 90 degrees at which roll and yaw can be distinguished. */
const UPRIGHT = 1e-9;

/** Returns the number of joints that move the tool. */
export function movingJoints(chain: ChainDescription): number {
  return chain.kind.slice(0, chain.joints).filter((kind) => kind === HINGE || kind === SLIDE).length;
}

/** Returns the pose of the tool, in the frame of the arm's poses. `q` contains joint positions, rad or m, in the order of the chain. */
export function toolPose(chain: ChainDescription, q: readonly number[]): Pose {
  let pose = poseOf(chain.base);
  for (let joint = 0; joint < chain.joints; joint += 1) {
    const moved = displacement(chain.kind[joint], vector(chain.axis[joint]), vector(chain.anchor[joint]), q[joint] ?? Number.NaN);
    if (moved) pose = composed(pose, moved);
  }
  return composed(composed(pose, poseOf(chain.home)), poseOf(chain.tool));
}

/** Returns the motion of the parts beyond a joint; null if the joint does not move the tool. */
export function displacement(kind: number | undefined, axis: Vector, anchor: Vector, q: number): Pose | null {
  if (kind === SLIDE) return { place: scaled(axis, q), turn: rotation(axis, 0) };
  if (kind !== HINGE) return null;
  const turn = rotation(axis, q);
  return { place: subtract(anchor, applied(turn, anchor)), turn };
}

/** Converts seven numbers to a pose: x y z (m), then the unit quaternion w x y z. */
export function poseOf(numbers: readonly number[]): Pose {
  const [x = 0, y = 0, z = 0, w = 1, i = 0, j = 0, k = 0] = numbers;
  return {
    place: [x, y, z],
    turn: [
      [1 - 2 * (j * j + k * k), 2 * (i * j - w * k), 2 * (i * k + w * j)],
      [2 * (i * j + w * k), 1 - 2 * (i * i + k * k), 2 * (j * k - w * i)],
      [2 * (i * k - w * j), 2 * (j * k + w * i), 1 - 2 * (i * i + j * j)],
    ],
  };
}

/** Transforms the pose `inner`, which is relative to `outer`, to the reference frame of `outer`. */
export function composed(outer: Pose, inner: Pose): Pose {
  const columns = [0, 1, 2].map((column) => applied(outer.turn, inner.turn.map((row) => row[column]) as Vector));
  const turn = [0, 1, 2].map((row) => columns.map((column) => column[row])) as Turn;
  return { place: add(outer.place, applied(outer.turn, inner.place)), turn };
}

/** Returns roll, pitch and yaw: rotations about the fixed x, then y, then z axis, rad. Yaw is 0 if the pitch is 90 degrees. */
export function rollPitchYaw({ turn: [x, y, z] }: Pose): Vector {
  const across = Math.hypot(x[0], y[0]);
  const pitch = Math.atan2(-z[0], across);
  if (across < UPRIGHT) return [Math.atan2(-y[2], y[1]), pitch, 0];
  return [Math.atan2(z[1], z[2]), pitch, Math.atan2(y[0], x[0])];
}

/** Returns the pose at a position (m), rotated by roll, pitch and yaw (rad). */
export function poseOfTurns(place: Vector, [roll, pitch, yaw]: Vector): Pose {
  const [x, y, z] = [rotation([1, 0, 0], roll), rotation([0, 1, 0], pitch), rotation([0, 0, 1], yaw)];
  const about = (turn: Turn): Pose => ({ place: [0, 0, 0], turn });
  return { place, turn: composed(about(z), composed(about(y), about(x))).turn };
}

/** Returns the inverse of a pose, that is, the pose of its reference frame relative to it. */
export function inverse({ place, turn }: Pose): Pose {
  const back = [0, 1, 2].map((column) => turn.map((row) => row[column])) as Turn;
  return { place: scaled(applied(back, place), -1), turn: back };
}

/** Converts a pose to seven numbers: x y z (m), then the unit quaternion w x y z. */
export function numbersOf({ place, turn: [x, y, z] }: Pose): number[] {
  // Each component is computed from the largest sum, so that no root is taken of a rounding error.
  const squares = [x[0] + y[1] + z[2], x[0] - y[1] - z[2], y[1] - x[0] - z[2], z[2] - x[0] - y[1]];
  const largest = squares.indexOf(Math.max(...squares));
  const r = Math.sqrt(1 + (squares[largest] ?? 0));
  const [a, b, c] = [z[1] - y[2], x[2] - z[0], y[0] - x[1]];
  const [d, e, f] = [y[0] + x[1], z[0] + x[2], z[1] + y[2]];
  const parts = [
    [r * r, a, b, c],
    [a, r * r, d, e],
    [b, d, r * r, f],
    [c, e, f, r * r],
  ][largest] as number[];
  return [...place, ...parts.map((part) => part / (2 * r))];
}

/** Returns the distance between two positions, m, and the angle between two orientations, rad. */
export function apart(one: Pose, other: Pose): [number, number] {
  const { turn } = composed(inverse(one), other);
  // Near 0 the sine resolves a small angle that the cosine has lost.
  const sine = Math.hypot(turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]) / 2;
  const cosine = (turn[0][0] + turn[1][1] + turn[2][2] - 1) / 2;
  return [Math.hypot(...subtract(other.place, one.place)), Math.atan2(sine, cosine)];
}

/** Returns the rotation about a unit vector by an angle, computed with Rodrigues' formula. */
function rotation([x, y, z]: Vector, angle: number): Turn {
  const [s, c] = [Math.sin(angle), Math.cos(angle)];
  const d = 1 - c;
  return [
    [c + x * x * d, x * y * d - z * s, x * z * d + y * s],
    [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
    [z * x * d - y * s, z * y * d + x * s, c + z * z * d],
  ];
}

export function vector(of: readonly number[] | undefined): Vector {
  const [x = 0, y = 0, z = 0] = of ?? [];
  return [x, y, z];
}

export function applied(turn: Turn, to: Vector): Vector {
  return turn.map((row) => row[0] * to[0] + row[1] * to[1] + row[2] * to[2]) as Vector;
}

export function add(a: Vector, b: Vector): Vector {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

export function subtract(a: Vector, b: Vector): Vector {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

function scaled(a: Vector, by: number): Vector {
  return [a[0] * by, a[1] * by, a[2] * by];
}
