// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { completedName, freeText, freshName, namesIn, type RunningRecording, recordingOf, sizeText, sumOf } from "./begun";

test("a recording gets a plain name", () => {
  expect(freshName("cell one/two", new Date(2026, 10, 23, 5, 7, 9))).toBe("cell-one-two-20261123-050709.mcap");
});

test("a name is completed", () => {
  const names = ["run", " run ", "run.mcap", "run.", "run.MCAP", "run.v2", "", "  "];
  expect(names.map(completedName)).toEqual(["run.mcap", "run.mcap", "run.mcap", "run.mcap", "run.mcap", "run.v2.mcap", "", ""]);
});

test("names of SVVs, all where none is given", () => {
  expect(namesIn(" arm.*, force ")).toEqual(["arm.*", "force"]);
  expect(namesIn("  ")).toBeNull();
});

test("sizes and sums for people", () => {
  expect([0, 1023, 1024, 12_900_000].map(sizeText)).toEqual(["0 B", "1023 B", "1.0 KiB", "12.3 MiB"]);
  expect(sumOf({ a: 1, b: 2 })).toBe(3);
});

test("a file belongs to the recording that wrote it, which stands as its newest file says", () => {
  const summary = {
    path: "/records/run.mcap",
    files: ["/records/run-2.mcap", "/records/run-3.mcap"],
    running: true,
    counts: {},
    lost: {},
    bytes: 7,
    free_bytes: 5,
    failure: null,
  };
  const split: RunningRecording = { recording: 1, run: "a", name: "run.mcap", summary };
  const fresh: RunningRecording = { recording: 2, run: "a", name: "other.mcap", summary: null };
  const all = [split, fresh];
  expect(recordingOf("run-2.mcap", all)).toEqual({ begun: split, isLast: false });
  expect(recordingOf("run-3.mcap", all)).toEqual({ begun: split, isLast: true });
  expect(recordingOf("other.mcap", all)).toEqual({ begun: fresh, isLast: true });
  expect(recordingOf("run.mcap", all)).toBeNull();
});

test("what is free on a disk, where that is known", () => {
  expect(freeText(12_900_000)).toBe("12.3 MiB free on its disk");
  expect(freeText(null)).toBe("");
});
