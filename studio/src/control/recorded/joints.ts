// SPDX-License-Identifier: Apache-2.0
// Where a machine's joints stood: the channels of devices are not recorded, the SVVs that are read from them are.
import type { Geometry, InstalledInstance } from "../shapes";

/** A machine whose joints follow the SVVs that blocks made of its channels; a joint whose channel nobody recorded follows none. */
export function onSvvs(geometry: Geometry, instances: readonly InstalledInstance[], recorded: (name: string) => boolean): Geometry {
  const made = new Map<string, string>();
  for (const { blocks } of instances) {
    for (const { ports } of blocks) {
      const from = ports.flatMap((port) => (port.cell !== null && !port.writes ? [port.cell] : []));
      for (const { cell, writes, unit } of ports) {
        if (cell === null || !writes || !recorded(cell)) continue;
        for (const channel of from) {
          const like = ports.find((port) => port.cell === channel)?.unit === unit;
          if (channel !== cell && like && !made.has(channel)) made.set(channel, cell);
        }
      }
    }
  }
  const joint = <J extends { svv?: string | null }>(of: J): J => {
    if (!of.svv || recorded(of.svv)) return of;
    return { ...of, svv: made.get(of.svv) ?? null };
  };
  return { ...geometry, bodies: geometry.bodies.map((body) => ({ ...body, joints: body.joints.map(joint) })) };
}
