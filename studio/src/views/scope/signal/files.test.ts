// SPDX-License-Identifier: Apache-2.0
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { McapIndexedReader } from "@mcap/core";
import { expect, test } from "vitest";
import { componentNames } from "./components";
import { csv } from "./csv";
import { runOf } from "./frames.testing";
import { mcap } from "./mcap";
import { Ring } from "./ring";
import { type ExportedChannel, secondsText } from "./table";

function channels(): ExportedChannel[] {
  const fast = new Ring(1, 1e15, 1e6);
  fast.take(runOf([1_000_000_001, 1_001_000_000, 1_005_000_000], [0.1, 1 / 3, 5], [1, 2, 6], 3));
  const slow = new Ring(2, 1e15, 1e6);
  slow.take(runOf([1_001_000_000], [7, 8], [1]));
  const odd = new Ring(2, 1e15, 1e6);
  odd.take(runOf([1_002_000_000], [1, Number.POSITIVE_INFINITY], [9]));
  return [
    { name: "arm.sensed", type_text: "double", unit: "rad", ring: fast, components: [{ name: "", index: 0 }], all: [""] },
    {
      name: "force",
      type_text: "struct { double x; double y[1]; }",
      unit: null,
      ring: slow,
      components: [{ name: ".y[0]", index: 1 }],
      all: [".x", ".y[0]"],
    },
    { name: "pid#1:e", type_text: "struct { bool on; float size; }", unit: "", ring: odd, components: [], all: [".on", ".size"] },
  ];
}

test("CSV has all digits, a row for each time, and says what is missing", () => {
  expect([...csv(channels().slice(0, 2), 0, 2e9)].join("")).toBe(
    [
      "# arm.sensed: 3 lost, behind 1.001000000 s and before 1.005000000 s",
      "time_s,arm.sensed (rad),force.y[0]",
      "1.000000001,0.1,",
      "1.001000000,0.3333333333333333,8",
      "1.005000000,5,",
      "",
    ].join("\n"),
  );
});

test("CSV holds the times that were asked for, and no others", () => {
  const lines = [...csv(channels().slice(0, 2), 1_001_000_000, 1_001_000_000)].join("").trim().split("\n");
  expect(lines.filter((line) => !line.startsWith("#"))).toEqual(["time_s,arm.sensed (rad),force.y[0]", "1.001000000,0.3333333333333333,8"]);
});

test("MCAP is read back as it was written", async () => {
  const parts = await mcap(channels(), 0, 2e9, "cell");
  const bytes = new Uint8Array(await new Blob(parts).arrayBuffer());
  const readable = {
    size: async () => BigInt(bytes.byteLength),
    read: async (offset: bigint, size: bigint) => bytes.slice(Number(offset), Number(offset + size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable });
  const read = [];
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    read.push([channel?.topic, message.logTime, JSON.parse(new TextDecoder().decode(message.data))]);
  }
  expect(read).toEqual([
    ["arm.sensed", 1_000_000_001n, { value: 0.1, number: 1 }],
    ["arm.sensed", 1_001_000_000n, { value: 1 / 3, number: 2 }],
    ["force", 1_001_000_000n, { value: { x: 7, y: [8] }, number: 1 }],
    ["pid#1:e", 1_002_000_000n, { value: { on: true, size: "Infinity" }, number: 9 }],
    ["arm.sensed", 1_005_000_000n, { value: 5, number: 6 }],
  ]);
  expect([...reader.channelsById.values()].map((channel) => channel.metadata.get("unit"))).toEqual(["rad", "", ""]);
});

// tests/python/test_page_export.py reads the same file; OPENGPAC_WRITE_EXPORT regenerates it.
test("an MCAP file is that which Python's test reads", async () => {
  const parts = await mcap(channels(), 0, 2e9, "cell");
  const bytes = Buffer.from(await new Blob(parts).arrayBuffer());
  const file = fileURLToPath(new URL("exported.testing.mcap", import.meta.url));
  if (process.env.OPENGPAC_WRITE_EXPORT) writeFileSync(file, bytes);
  expect(bytes.equals(readFileSync(file))).toBe(true);
});

test("times are written to the nanosecond", () => {
  expect(secondsText(0)).toBe("0.000000000");
  expect(secondsText(12_000_000_001)).toBe("12.000000001");
  expect(secondsText(-1)).toBe("-0.000000001");
});

test("the numbers of a value have the names of C", () => {
  expect(componentNames("double", 1)).toEqual([""]);
  expect(componentNames("double[3]", 3)).toEqual(["[0]", "[1]", "[2]"]);
  expect(componentNames("float[2][2]", 4)).toEqual(["[0][0]", "[0][1]", "[1][0]", "[1][1]"]);
  expect(componentNames("struct { double x; double q[2]; }", 3)).toEqual([".x", ".q[0]", ".q[1]"]);
  expect(componentNames("struct { double[2] q; bool on; }[2]", 6)).toEqual([
    "[0].q[0]",
    "[0].q[1]",
    "[0].on",
    "[1].q[0]",
    "[1].q[1]",
    "[1].on",
  ]);
  expect(componentNames("something else", 2)).toEqual(["[0]", "[1]"]);
});
