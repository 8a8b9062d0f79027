// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Configuration, DeviceType, SvvSpecification } from "../../control/shapes";
import { columnsOf, familiesOf, shortName, svvName } from "./families";

const svv = (type_text: string, shared: string | null = null): SvvSpecification => ({
  type_text,
  unit: "",
  history: 0,
  within: null,
  shared,
  initial: null,
});
const joint = {
  name: "robot_joint",
  doc: "",
  verb: null,
  svvs: { sensed: svv("double"), pose: svv("double[7]"), cell_override: svv("double", "override"), homed: svv("bool") },
  parameters: {},
  arbitration: "refuse",
  place: null,
} satisfies DeviceType;
const configuration: Configuration = {
  processors: {},
  sources: {},
  physical_devices: {},
  logical_devices: { "ur5e.elbow": "robot_joint", valve: "digital_output", "ur5e.wrist": "robot_joint" },
  device_types: { robot_joint: joint, digital_output: { ...joint, name: "digital_output" } },
};

test("devices of one type and one beginning are a family", () => {
  const families = familiesOf(configuration).map((family) => [family.name, family.devices]);
  expect(families).toEqual([
    ["ur5e", ["ur5e.elbow", "ur5e.wrist"]],
    ["digital_output", ["valve"]],
  ]);
  expect(shortName("ur5e.elbow")).toBe("elbow");
});

test("an SVV that devices share has the system's name, and no column", () => {
  expect(svvName("ur5e.elbow", "sensed", joint.svvs.sensed)).toBe("ur5e.elbow.sensed");
  expect(svvName("ur5e.elbow", "cell_override", joint.svvs.cell_override)).toBe("override");
  expect(columnsOf(joint).map(([name]) => name)).toEqual(["sensed", "homed"]);
});
