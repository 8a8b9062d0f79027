// SPDX-License-Identifier: Apache-2.0
// A second machine that stands where the first is told to be: at the goals of its joints, or at what is commanded now.
import { Color, Mesh, MeshStandardMaterial } from "three";
import { onSvvs } from "../../control/recorded/joints";
import type { Geometry, InstalledInstance } from "../../control/shapes";
import { colour } from "../../design/colours";
import { type BuiltMachine, buildMachine } from "./machine";

/** Members of a joint that say where it is to be. */
export const AIMS = ["goal", "commanded"] as const;
export type Aim = (typeof AIMS)[number];
const SENSED = ".sensed";

/**
 * The shape with its joints where they are to be: each follows the member of its device that is called so, beside the sensed position
 * that is read from its channel. Null: no joint has one.
 */
export function aimed(
  geometry: Geometry,
  aim: Aim,
  instances: readonly InstalledInstance[],
  known: (name: string) => boolean,
): Geometry | null {
  let found = false;
  // In a recording a joint may follow a private cell before it: the sensed position is made of that.
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

/** The machine that is seen through. */
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
