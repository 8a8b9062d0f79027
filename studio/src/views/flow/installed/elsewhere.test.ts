// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { InstalledBlock, InstalledInstance, InstalledPort } from "../../../control/shapes";
import { foundIn } from "../drawing/Find";
import { drawn } from "./drawn";
import { everythingIn, instanceOf } from "./elsewhere";

const port = (name: string, direction: InstalledPort["direction"]): InstalledPort =>
  ({
    name,
    direction,
    type_text: "double",
    unit: "",
    mode: "synchronous",
    doc: "",
    cell: null,
    writes: false,
    required: false,
  }) as InstalledPort;
const block = (label: string): InstalledBlock =>
  ({ label, block: "library.gain", doc: "", source: "rtp0.fast", every_ns: 0, ports: [port("u", "input"), port("y", "output")] }) as never;
const cell = (name: string, kind: string, writers: string[], readers: string[]) =>
  ({ name, kind, type_text: "double", unit: "", writers: writers.map((w) => [w, "y"]), readers: readers.map((r) => [r, "u"]) }) as never;
const instance = (name: string, blocks: InstalledBlock[], cells: InstalledInstance["cells"]): InstalledInstance =>
  ({ id: 1, name, verb: "v", blocks, cells, state: "running", owner: null }) as never;

const one = instance(
  "one#1",
  [block("servo.inner.pid"), block("servo.filter")],
  [cell("one#1:smooth", "private", ["servo.filter"], ["servo.inner.pid"]), cell("shared.svv", "svv", ["servo.inner.pid"], [])],
);
const two = instance("two#1", [block("watch")], [cell("shared.svv", "svv", [], ["watch"]), cell("own.svv", "svv", ["watch"], [])]);

test("a block is found within graphs that are closed, with what must be opened for it", () => {
  const opened: [string, string[]][] = [];
  const all = everythingIn([one, two], (name, graphs) => opened.push([name, graphs]));
  const [pid] = foundIn(all, "inner.pid");
  expect(pid).toMatchObject({ text: "servo.inner.pid", box: "one#1/servo.inner.pid", within: { text: "one#1/servo.inner" } });
  pid?.within?.open();
  expect(opened).toEqual([["one#1", ["one#1/servo", "one#1/servo.inner"]]]);
  const [cellOf] = foundIn(all, "smooth");
  cellOf?.within?.open();
  expect(opened[1]?.[1]).toContain("one#1/servo.inner");
  expect(foundIn(all, "shared.svv").filter(({ text }) => text === "shared.svv")).toHaveLength(1);
  expect(foundIn(all, "watch")[0]?.within?.text).toBe("two#1");
});

test("an SVV belongs to the instance that alone uses it", () => {
  const drawing = drawn([one, two], new Set(["one#1/servo", "one#1/servo.inner"]));
  expect(instanceOf(drawing, "one#1/servo.inner.pid")).toBe("one#1");
  expect(instanceOf(drawing, "cell/own.svv")).toBe("two#1");
  expect(instanceOf(drawing, "cell/shared.svv")).toBeNull();
});
