// SPDX-License-Identifier: Apache-2.0
import { Vector3 } from "three";
import { expect, test } from "vitest";
import type { Geometry } from "../../control/shapes";
import { buildMachine } from "./machine";

const body = (name: string, parent: string | null, z: number): Geometry["bodies"][number] => ({
  name,
  parent,
  position: [0, 0, z],
  quaternion: [1, 0, 0, 0],
  joint: null,
  joints: [],
  geoms: [],
});

const geom = {
  kind: "box",
  size: [0.1, 0.1, 0.1],
  position: [0, 0, 0.5],
  quaternion: [1, 0, 0, 0],
  rgba: [1, 0, 0, 1],
  mesh: null,
} as Geometry["bodies"][number]["geoms"][number];

function place(machine: ReturnType<typeof buildMachine>): number[] {
  machine.root.updateMatrixWorld(true);
  let found = new Vector3();
  machine.root.traverse((object) => {
    if (object.type === "Mesh") found = object.getWorldPosition(new Vector3());
  });
  return found.toArray().map((value) => Math.round(value * 1e6) / 1e6 + 0);
}

test("a hinge turns what hangs on it about its anchor, from its reference", () => {
  const hinge = {
    name: "elbow",
    kind: "hinge",
    axis: [0, 2, 0],
    position: [0, 0, 0.1],
    reference: 0.5,
    svv: "arm.elbow.position",
  } as const;
  const machine = buildMachine({
    bodies: [
      body("world", null, 0),
      { ...body("link", "world", 1), joints: [{ ...hinge, axis: [0, 2, 0], position: [0, 0, 0.1] }], geoms: [geom] },
    ],
    meshes: [],
    contacts: null,
  });
  expect(place(machine)).toEqual([0, 0, 1.5]);
  machine.joints[0]?.move(0.5 + Math.PI / 2);
  expect(place(machine)).toEqual([0.4, 0, 1.1]);
});

test("a slide moves along its axis, in the frame of its body's parent", () => {
  const slide = {
    name: "rail",
    kind: "slide" as const,
    axis: [1, 0, 0] as [number, number, number],
    position: [0, 0, 0] as [number, number, number],
    reference: 0,
    svv: "rail",
  };
  const turned = {
    ...body("cart", "world", 0),
    quaternion: [Math.SQRT1_2, 0, 0, Math.SQRT1_2] as [number, number, number, number],
    joints: [slide],
    geoms: [geom],
  };
  const machine = buildMachine({ bodies: [body("world", null, 0), turned], meshes: [], contacts: null });
  machine.joints[0]?.move(2);
  expect(place(machine)).toEqual([0, 2, 0.5]);
});

test("a joint that nobody tells of stays, and is named", () => {
  const free = {
    name: "ball",
    kind: "free" as const,
    axis: [0, 0, 1] as [number, number, number],
    position: [0, 0, 0] as [number, number, number],
    reference: null,
    svv: null,
  };
  const machine = buildMachine({
    bodies: [body("world", null, 0), { ...body("ball", "world", 1), joints: [free], geoms: [geom] }],
    meshes: [],
    contacts: null,
  });
  expect(machine.still).toEqual(["ball"]);
  expect(place(machine)).toEqual([0, 0, 1.5]);
});

test("a free body stands where its pose says, in the world", () => {
  const free = {
    name: "ball",
    kind: "free" as const,
    axis: [0, 0, 1] as [number, number, number],
    position: [0, 0, 0] as [number, number, number],
    reference: null,
    svv: "cell.ball.pose",
  };
  const machine = buildMachine({
    bodies: [body("world", null, 0), { ...body("ball", "world", 1), joints: [free], geoms: [geom] }],
    meshes: [],
    contacts: null,
  });
  expect(machine.still).toEqual([]);
  machine.free[0]?.place([1, 2, 3, Math.SQRT1_2, Math.SQRT1_2, 0, 0]);
  // Rotated about x, the point above the origin is now beside it.
  expect(place(machine)).toEqual([1, 1.5, 3]);
});
