// SPDX-License-Identifier: Apache-2.0
// Installed objects that are not drawn: hidden instances, blocks in closed graphs.
import type { InstalledInstance } from "../../../control/shapes";
import { type Findable, findables } from "../drawing/Find";
import { drawn, graphsOf } from "./drawn";

/** Returns the objects of all instances, with all graphs opened. `open` shows an instance, and opens the graphs with these ids. */
export function everythingIn(instances: InstalledInstance[], open: (instance: string, graphs: string[]) => void): Findable[] {
  const found = new Map<string, Findable>();
  for (const instance of instances) {
    const whole = drawn([instance], new Set(graphsOf(instance)));
    const ends = new Map(whole.wires.map((wire) => [wire.id, [wire.from.box, wire.to.box]]));
    for (const one of findables(whole)) {
      const boxes = one.chosen.kind === "wire" ? (ends.get(one.chosen.id) ?? []) : [one.box];
      const graphs = boxes.flatMap(graphsAround);
      const [around] = graphs.slice(-1);
      const within = { text: around ?? instance.name, open: () => open(instance.name, graphs) };
      // An SVV of several instances is listed once.
      if (!found.has(one.key)) found.set(one.key, { ...one, within });
    }
  }
  return [...found.values()];
}

/** Returns the ids of the graphs around a box, outermost first: `move#1/outer`, `move#1/outer.inner`. */
function graphsAround(box: string): string[] {
  const [instance, label] = [box.slice(0, box.indexOf("/")), box.slice(box.indexOf("/") + 1)];
  if (instance === "cell") return [];
  const parts = label.split(".");
  return parts.slice(1).map((_, depth) => `${instance}/${parts.slice(0, depth + 1).join(".")}`);
}

/** Returns the instance to which a box belongs; for an SVV or channel, the only instance that uses it, otherwise null. */
export function instanceOf(drawing: { wires: { from: { box: string }; to: { box: string } }[] }, box: string): string | null {
  const own = (id: string) => (id.startsWith("cell/") ? null : id.slice(0, id.indexOf("/")));
  if (!box.startsWith("cell/")) return own(box);
  const wires = drawing.wires.filter(({ from, to }) => from.box === box || to.box === box);
  const users = new Set(wires.map(({ from, to }) => own(from.box === box ? to.box : from.box)));
  const [only = null] = users;
  return users.size === 1 ? only : null;
}
