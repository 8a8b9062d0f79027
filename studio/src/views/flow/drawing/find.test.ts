// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Box, Drawing, Port } from "./drawing";
import { findables, foundIn as foundAmong } from "./Find";

const port = (name: string, side: Port["side"]): Port => ({ name, side, type_text: "double", unit: "", mode: "", doc: "" });
const box = (id: string, kind: Box["kind"], about: string, ports: Port[] = []): Box => ({
  id,
  kind,
  title: id.replace(/^cell\//, ""),
  about,
  doc: "",
  ports,
  source: null,
  opens: null,
  findings: [],
});
const drawing: Drawing = {
  boxes: [
    box("servo", "block", "pid", [port("sensed", "input"), port("effort", "output")]),
    box("filter", "block", "lowpass", [port("u", "input"), port("y", "output")]),
    box("cell/arm.shoulder.sensed", "svv", "SVV"),
  ],
  wires: [
    {
      id: "one",
      from: { box: "filter", port: "y" },
      to: { box: "servo", port: "sensed" },
      cell: "smooth",
      live: null,
      type_text: "double",
      unit: "",
      mode: "",
      findings: [],
    },
  ],
};

const foundIn = (of: Drawing, typed: string) => foundAmong(findables(of), typed);

test("blocks, what they are, ports, SVVs and cells are found by a few letters, the best first", () => {
  expect(foundIn(drawing, "servo")[0]).toMatchObject({ text: "servo", chosen: { kind: "box", id: "servo" } });
  expect(foundIn(drawing, "lowp").map(({ text }) => text)).toEqual(["filter"]);
  expect(foundIn(drawing, "shsens")[0]).toMatchObject({ text: "arm.shoulder.sensed", box: "cell/arm.shoulder.sensed" });
  expect(foundIn(drawing, "fily")[0]).toMatchObject({ text: "filter.y", about: "output" });
  expect(foundIn(drawing, "smooth")[0]).toMatchObject({ box: "filter", chosen: { kind: "wire", id: "one" } });
  expect(foundIn(drawing, "xyz")).toEqual([]);
  expect(foundIn(drawing, " ")).toEqual([]);
});
