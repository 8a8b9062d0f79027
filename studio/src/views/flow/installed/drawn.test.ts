// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { InstalledBlock, InstalledInstance, InstalledPort } from "../../../control/shapes";
import { drawn, graphsOf } from "./drawn";

function port(name: string, direction: InstalledPort["direction"], cell: string | null = null): InstalledPort {
  return {
    name,
    direction,
    type_text: "double",
    unit: "rad",
    mode: "synchronous",
    doc: "",
    cell,
    writes: direction === "output",
    required: false,
  };
}

const ACTIVE = { on: true, due: "interval" as const, by: [], rates: {}, budget_ns: null, tunable: false };

function block(label: string, ports: InstalledPort[]): InstalledBlock {
  return {
    label,
    block: "library.gain",
    doc: "y = k u",
    source: "rtp0.fast",
    size: null,
    file: "",
    every_ns: 1_000_000,
    activation: ACTIVE,
    ports,
  };
}

function instance(blocks: InstalledBlock[], cells: InstalledInstance["cells"]): InstalledInstance {
  return {
    id: 1,
    name: "v#1",
    verb: "v",
    state: "running",
    list: "start",
    owner: null,
    stage: 0,
    starts: 1,
    inputs: {},
    devices: [],
    device: null,
    blocks,
    cells,
    lists: [],
    conditions: [],
    transitions: [],
    initial: "start",
    ending: null,
  };
}

const cell = (name: string, kind: "svv" | "private" | "constant", writers: [string, string][], readers: [string, string][]) => ({
  name,
  kind,
  type_text: "double",
  unit: "rad",
  writers,
  readers,
});

const chain = instance(
  [
    block("a", [port("u", "input"), port("y", "output"), port("k", "parameter")]),
    block("g.b", [port("u", "input"), port("y", "output")]),
    block("g.c", [port("u", "input"), port("y", "output")]),
  ],
  [
    cell("x", "svv", [], [["a", "u"]]),
    cell("v#1:ab", "private", [["a", "y"]], [["g.b", "u"]]),
    cell("v#1:bc", "private", [["g.b", "y"]], [["g.c", "u"]]),
    cell("z", "svv", [["g.c", "y"]], []),
    cell("v#1:one", "constant", [], [["a", "k"]]),
  ],
);

test("a private cell is a wire with its value, an SVV a box", () => {
  const { boxes, wires } = drawn([chain], new Set(["v#1/g"]));
  expect(boxes.map((box) => box.title)).toEqual(["a", "g.b", "g.c", "x", "z"]);
  expect(wires.map((wire) => [wire.from.box, wire.to.box, wire.live])).toEqual([
    ["cell/x", "v#1/a", "x"],
    ["v#1/a", "v#1/g.b", "v#1:ab"],
    ["v#1/g.b", "v#1/g.c", "v#1:bc"],
    ["v#1/g.c", "cell/z", "z"],
  ]);
});

test("a closed graph is one box with the ports that cross its edge", () => {
  const { boxes, wires } = drawn([chain], new Set());
  const graph = boxes.find((box) => box.kind === "graph");
  expect(graph?.ports.map((one) => [one.side, one.name])).toEqual([
    ["input", "b.u"],
    ["output", "c.y"],
  ]);
  expect(wires.map((wire) => wire.cell)).toEqual(["x", "v#1:ab", "z"]);
  expect(graphsOf(chain)).toEqual(["v#1/g"]);
});

test("an SVV that two instances share is one box, and parameters are no ports", () => {
  const reader = { ...instance([block("r", [port("u", "input")])], [cell("z", "svv", [], [["r", "u"]])]), id: 2, name: "w#1" };
  const { boxes, wires } = drawn([chain, reader], new Set());
  const shared = boxes.filter((box) => box.title === "z");
  expect(shared).toHaveLength(1);
  expect(shared[0]?.ports.map((one) => one.side)).toEqual(["input", "output"]);
  expect(wires.filter((wire) => wire.live === "z")).toHaveLength(1);
  expect(boxes.find((box) => box.title === "a")?.ports.map((one) => one.name)).toEqual(["u", "y"]);
});
