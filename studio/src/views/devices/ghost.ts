// SPDX-License-Identifier: Apache-2.0
// A second machine at the commanded pose of the first: at the goals of its joints, or at the present commanded positions.
import { Color, Mesh, MeshStandardMaterial } from "three";
import { onSvvs } from "../../control/recorded/joints";
import type { Geometry, InstalledInstance } from "../../control/shapes";
import { colour } from "../../design/colours";
import { type BuiltMachine, buildMachine } from "./machine";

/** Members of a joint that contain a target position. */
export const AIMS = ["goal", "commanded"] as const;
export type Aim = (typeof AIMS)[number];
const SENSED = ".sensed";

/**
 * Returns the geometry with its joints at their targets: each joint follows the member `aim` of the device whose `sensed` position is
 * read from the joint's channel. Returns null if no joint has such a member.
 */
export function aimed(
  geometry: Geometry,
  aim: Aim,
  instances: readonly InstalledInstance[],
  known: (name: string) => boolean,
): Geometry | null {
  let found = false;
  // In a recording, a joint may follow a private cell from which the sensed position is computed.
  const sensed = onSvvs(geometry, instances, (name) => name.endsWith(SENSED) && known(name));
  const bodies = geometry.bodies.map((body, at) => ({
    ...body,
    joints: body.joints.map((joint, of) => {
      const beside = sensed.bodies[at]?.joints[of]?.svv;
      const name = beside ? `${beside.slice(0, -SENSED.length)}.${aim}` : null;
      if (name === null || !known(name)) return joint;
      found = true;
      return { ...joint, svv: name };
    }),
  }));
  return found ? { ...geometry, bodies } : null;
}

/** Builds the translucent machine. */
export function buildGhost(geometry: Geometry): BuiltMachine {
  const built = buildMachine(geometry);
  built.root.traverse((object) => {
    if (!(object instanceof Mesh && object.material instanceof MeshStandardMaterial)) return;
    object.material.color = new Color(colour("--accent"));
    object.material.opacity = 0.28;
    object.material.transparent = true;
    object.material.depthWrite = false;
  });
  return built;
}
