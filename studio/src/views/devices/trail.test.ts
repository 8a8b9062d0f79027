// SPDX-License-Identifier: Apache-2.0
import { Vector3 } from "three";
import { expect, test } from "vitest";
import type { Geometry, InstalledInstance, RecordedSpan } from "../../control/shapes";
import type { Past } from "../../control/source";
import { WatchedValue } from "../../control/watched";
import { aimed } from "./ghost";
import { LivePath, RecordedPath, toolOf } from "./trail";

const body = (name: string, parent: string | null, position: [number, number, number], svv?: string): Geometry["bodies"][number] => ({
  name,
  parent,
  position,
  quaternion: [1, 0, 0, 0],
  joint: null,
  joints: svv ? [{ name: `${name}_joint`, kind: "hinge", axis: [0, 0, 1], position: [0, 0, 0], reference: 0, svv }] : [],
  geoms: [],
});

/** Two links of 1 m that rotate about z, with a hand at the end. */
const ARM: Geometry = {
  meshes: [],
  contacts: null,
  bodies: [
    body("world", null, [0, 0, 0]),
    body("one", "world", [0, 0, 0], "arm.a.sensed"),
    body("two", "one", [1, 0, 0], "arm.b.sensed"),
    body("hand", "two", [1, 0, 0]),
    body("table", "world", [3, 0, 0]),
  ],
};

function samples(times: number[], values: number[]): string {
  const view = new DataView(new ArrayBuffer(24 * times.length));
  times.forEach((time, at) => {
    view.setBigInt64(16 * at, BigInt(time), true);
    view.setFloat64(16 * times.length + 8 * at, values[at] ?? 0, true);
  });
  return btoa(Array.from(new Uint8Array(view.buffer), (byte) => String.fromCharCode(byte)).join(""));
}

/** Returns a recording of 10 s in which the first joint rotates at 1 rad/s and the second stays at a right angle. */
function past(asked: [number, number][]): Past {
  const channel = (name: string) => ({ name, type_text: "double", unit: "rad", components: 1 });
  return {
    begins_ns: 0,
    ends_ns: 10e9,
    cursor: new WatchedValue(0),
    channel,
    async *span(_: string[], from_ns: number, to_ns: number) {
      asked.push([from_ns, to_ns]);
      const times = Array.from({ length: 1001 }, (_, at) => at * 1e7);
      const one = {
        samples: samples(
          times,
          times.map((time) => time / 1e9),
        ),
        sums: [],
      };
      yield { channels: [one, { samples: samples([0], [Math.PI / 2]), sums: [] }], next: null } satisfies RecordedSpan;
    },
  } as unknown as Past;
}

test("the tool is what the longest chain of joints moves last", () => {
  expect(toolOf(ARM)).toBe("hand");
  expect(toolOf({ meshes: [], contacts: null, bodies: [body("world", null, [0, 0, 0])] })).toBeNull();
});

test("the path in a recording is that of the joints as they were stored, around the cursor", async () => {
  const asked: [number, number][] = [];
  const path = new RecordedPath(past(asked), ARM, "hand", 1e9);
  const places = await path.around(5e9, new AbortController().signal);
  expect(places.length).toBeGreaterThan(50);
  for (const { time_ns, at } of places) {
    expect(Math.abs(time_ns - 5e9)).toBeLessThanOrEqual(1e9);
    const angle = time_ns / 1e9;
    // A value holds until the next one, 10 ms later.
    expect(at.distanceTo(new Vector3(Math.cos(angle) - Math.sin(angle), Math.sin(angle) + Math.cos(angle), 0))).toBeLessThan(0.02);
  }
  // A small movement of the cursor requests nothing.
  await path.around(5.5e9, new AbortController().signal);
  expect(asked).toEqual([[3e9, 7e9]]);
  await path.around(9e9, new AbortController().signal);
  expect(asked.at(-1)).toEqual([7e9, 10e9]);
});

test("the path of what runs goes so far back, and begins anew where time goes back", () => {
  const path = new LivePath(1e9);
  for (let at = 0; at < 30; at += 1) path.add(at * 1e8, new Vector3(at, 0, 0));
  expect(path.add(3e9, new Vector3(30, 0, 0)).map((place) => place.at.x)).toEqual([20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30]);
  expect(path.add(1e8, new Vector3(5, 0, 0)).map((place) => place.at.x)).toEqual([5]);
});

test("a ghost follows the goals of the joints that have one", () => {
  const known = new Set(["arm.a.sensed", "arm.a.goal", "arm.b.sensed"]);
  const there = aimed(ARM, "goal", [], (name) => known.has(name));
  expect(there?.bodies.flatMap((one) => one.joints.map((joint) => joint.svv))).toEqual(["arm.a.goal", "arm.b.sensed"]);
  expect(aimed(ARM, "commanded", [], (name) => known.has(name))).toBeNull();
  // A joint follows a private cell from which its sensed position is computed.
  const port = (writes: boolean, cell: string) => ({ writes, cell });
  const read = { blocks: [{ ports: [port(false, "servo:reading"), port(true, "arm.a.sensed")] }] } as unknown as InstalledInstance;
  const cells = { meshes: [], contacts: null, bodies: [body("world", null, [0, 0, 0]), body("one", "world", [0, 0, 0], "servo:reading")] };
  const all = new Set([...known, "servo:reading"]);
  expect(aimed(cells, "goal", [read], (name) => all.has(name))?.bodies[1]?.joints[0]?.svv).toBe("arm.a.goal");
});
