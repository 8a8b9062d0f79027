// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Geometry, InstalledInstance } from "../shapes";
import { onSvvs } from "./joints";

const port = (writes: boolean, cell: string) => ({ writes, cell });
const INSTANCES = [
  {
    blocks: [
      { ports: [port(false, "arm.position"), port(true, "servo:reading")] },
      { ports: [port(false, "servo:reading"), port(false, "arm.offset"), port(true, "arm.sensed")] },
      { ports: [port(false, "arm.sensed"), port(true, "arm.effort"), port(true, "arm.reference")] },
    ],
  },
] as unknown as InstalledInstance[];

function follows(svv: string | null, recorded: string[]): (string | null)[] {
  const geometry = { bodies: [{ joint: null, joints: [{ name: "j", svv }] }], meshes: [] } as unknown as Geometry;
  return onSvvs(geometry, INSTANCES, (name) => recorded.includes(name)).bodies.flatMap((body) => body.joints.map((joint) => joint.svv));
}

test("a joint follows the nearest cell behind its channel that was recorded", () => {
  expect(follows("arm.position", ["arm.sensed", "servo:reading"])).toEqual(["servo:reading"]);
  expect(follows("arm.position", ["arm.sensed", "arm.offset"])).toEqual(["arm.sensed"]);
  expect(follows("arm.position", ["arm.effort"])).toEqual([null]);
  expect(follows(null, ["arm.sensed"])).toEqual([null]);
});

test("contacts are those that a block has read and that were recorded, also of a recording from before there were any", () => {
  const contacts = (svv: string | null | undefined, recorded: string[]) =>
    onSvvs({ bodies: [], meshes: [], contacts: svv } as unknown as Geometry, INSTANCES, (name) => recorded.includes(name)).contacts;
  expect(contacts("arm.position", ["servo:reading"])).toBe("servo:reading");
  expect(contacts("arm.position", [])).toBeNull();
  expect(contacts(null, ["arm.sensed"])).toBeNull();
  expect(contacts(undefined, ["arm.sensed"])).toBeNull();
});
