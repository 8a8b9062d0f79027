// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Configuration, FormArgument, Verb, VerbForm } from "../../control/shapes";
import { argumentsOf, choicesOf, devicesOf, families, firstChoices } from "./arguments";

const argument = (given: Partial<FormArgument> & Pick<FormArgument, "name" | "kind">): FormArgument => ({
  of: null,
  type_text: "",
  unit: "",
  doc: "",
  members: [],
  ...given,
});

const channel = (name: string, write = false) => ({ name, write, type_text: "double", unit: "" });

const form: VerbForm = {
  name: "guarded_move",
  doc: "",
  manual: false,
  arguments: [
    argument({ name: "arm", kind: "group", of: "robot_joint" }),
    argument({ name: "force", kind: "channel", type_text: "double[3]" }),
    argument({ name: "level", kind: "svv", type_text: "double" }),
    argument({ name: "drive", kind: "channel", members: ["position", "effort"] }),
  ],
  inputs: [],
  defined: {} as Verb,
};

const configuration = {
  processors: {},
  sources: {},
  physical_devices: {
    ur5e: { source: "rtp0.fast", channels: [channel("tool.force"), channel("elbow.position"), channel("elbow.effort", true)] },
  },
  logical_devices: { "ur5e.shoulder": "robot_joint", "ur5e.elbow": "robot_joint", valve: "digital_output", "other.elbow": "robot_joint" },
  device_types: {},
} satisfies Configuration;

test("devices of the type, channels of all physical devices", () => {
  const options = choicesOf(form, configuration);
  expect(options.arm).toEqual(["ur5e.shoulder", "ur5e.elbow", "other.elbow"]);
  expect(options.force).toEqual(["ur5e/tool.force", "ur5e/elbow.position", "ur5e/elbow.effort"]);
  expect(options.drive).toEqual(["ur5e/elbow"]);
});

test("the first arm as a whole is chosen at first", () => {
  const options = choicesOf(form, configuration);
  expect(families(options.arm ?? []).map((one) => one.family)).toEqual(["ur5e", "other"]);
  expect(firstChoices(form, options)).toEqual({ arm: ["ur5e.shoulder", "ur5e.elbow"], drive: ["ur5e/elbow"] });
  expect(devicesOf(form, firstChoices(form, options))).toEqual(["ur5e.shoulder", "ur5e.elbow"]);
});

test("choices as the call takes them", () => {
  expect(argumentsOf(form, { arm: ["ur5e.elbow"], force: ["ur5e/tool.force"], level: ["a, b"], drive: ["ur5e/elbow"] })).toEqual({
    arm: { devices: ["ur5e.elbow"] },
    force: { channel: { device: "ur5e", channel: "tool.force" } },
    level: { svvs: ["a", "b"] },
    drive: { part: { device: "ur5e", part: "elbow" } },
  });
});
