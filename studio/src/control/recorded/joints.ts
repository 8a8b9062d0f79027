// SPDX-License-Identifier: Apache-2.0
// Joint positions and contacts of a machine in a recording: they come from recorded readings, since channels of devices are not recorded.
import type { Geometry, GeometryJoint, InstalledInstance } from "../shapes";

/** Maximum number of blocks between a channel and a recorded cell: one block reads the channel, another subtracts its offset. */
const STEPS_MAX = 2;

/**
 * Returns a machine whose joints and contacts follow recorded cells computed from their channels. Joints without a recorded cell do not
 * move.
 */
export function onSvvs(geometry: Geometry, instances: readonly InstalledInstance[], recorded: (name: string) => boolean): Geometry {
  const made = madeOf(instances);
  const joint = (of: GeometryJoint): GeometryJoint => (of.svv === null ? of : { ...of, svv: found(of.svv, made, recorded) });
  return {
    ...geometry,
    // Older recordings contain no contacts.
    contacts: geometry.contacts ? found(geometry.contacts, made, recorded) : null,
    bodies: geometry.bodies.map((body) => ({ ...body, joint: body.joint && joint(body.joint), joints: body.joints.map(joint) })),
  };
}

/** Returns the nearest recorded cell that is computed from a channel, or the channel itself if it was recorded. */
function found(channel: string, made: ReadonlyMap<string, readonly string[]>, recorded: (name: string) => boolean): string | null {
  let reached = [channel];
  for (let steps = 0; steps <= STEPS_MAX; steps += 1) {
    const known = reached.find(recorded);
    if (known !== undefined) return known;
    reached = reached.flatMap((cell) => made.get(cell) ?? []);
  }
  return null;
}

/** Returns, for each cell, the cells that single-output blocks compute from it. */
function madeOf(instances: readonly InstalledInstance[]): ReadonlyMap<string, readonly string[]> {
  const made = new Map<string, string[]>();
  for (const { ports } of instances.flatMap(({ blocks }) => blocks)) {
    const [output, ...more] = ports.flatMap((port) => (port.writes && port.cell !== null ? [port.cell] : []));
    if (output === undefined || more.length > 0) continue;
    for (const port of ports) {
      if (port.writes || port.cell === null) continue;
      made.set(port.cell, [...(made.get(port.cell) ?? []), output]);
    }
  }
  return made;
}
