// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { InstalledInstances, InstalledPort, SourceStatistics, Statistics } from "../../control/shapes";
import { connectionsOf } from "./connections";
import { load, quantile, sinceBaseline, sourcesOf } from "./sources";

const bins = (...given: [number, number][]) => {
  const all = Array<number>(32).fill(0);
  for (const [bin, counted] of given) all[bin] = counted;
  return all;
};

const source = (given: Partial<SourceStatistics>): SourceStatistics => ({
  steps: 1,
  firings: 100,
  overruns: 2,
  late: 0,
  faults: 0,
  lost: 0,
  stopped: false,
  rights_missing: [],
  jitter_last_ns: 0,
  jitter_max_ns: 0,
  jitter_bins: bins([13, 100]),
  jitter_median_ns: 0,
  duration_sum_ns: 0,
  duration_last_ns: 0,
  duration_max_ns: 0,
  duration_bins: bins([15, 99], [19, 1]),
  duration_median_ns: 0,
  processor: "rtp0",
  priority: 80,
  kind: "timer",
  period_ns: 1_000_000,
  core: null,
  rights_asked: [],
  probed: false,
  blocks: [],
  ...given,
});

const statistics = (sources: Record<string, SourceStatistics>) => ({ now_s: 1, sources }) as unknown as Statistics;

test("the most urgent source comes first", () => {
  const now = statistics({ "rtp0.slow": source({ priority: 60 }), "rtp0.fast": source({}) });
  expect(sourcesOf(now, null).map((one) => one.name)).toEqual(["rtp0.fast", "rtp0.slow"]);
});

test("quantiles are upper edges of bins, the load is the mean duration over the period", () => {
  expect(quantile(bins([15, 99], [19, 1]), 0.5)).toBe(2 ** 16);
  expect(quantile(bins([15, 99], [19, 1]), 0.999)).toBe(2 ** 20);
  expect(quantile(bins(), 0.5)).toBe(0);
  const [fast] = sourcesOf(statistics({ "rtp0.fast": source({}) }), null);
  expect(fast && load(fast)).toBeCloseTo((0.99 * 2 ** 15.5 + 0.01 * 2 ** 19.5) / 1e6, 9);
  expect(fast && load({ ...fast, period_ns: null })).toBeNull();
});

test("counting from now on subtracts what was before; a source that began anew is whole", () => {
  const [fast] = sourcesOf(statistics({ "rtp0.fast": source({ firings: 150, duration_bins: bins([15, 140], [19, 10]) }) }), null);
  if (!fast) throw new Error("there is a source");
  const counted = sinceBaseline(fast, { at_s: 0, of: { "rtp0.fast": source({}) } });
  expect([counted.firings, counted.overruns, counted.duration_bins[15], counted.duration_bins[19]]).toEqual([50, 0, 41, 9]);
  expect(counted.duration_max_ns).toBe(2 ** 20);
  expect(sinceBaseline(fast, { at_s: 0, of: { "rtp0.fast": source({ firings: 1000 }) } })).toBe(fast);
});

test("connections: what one source writes and another one reads, by mode", () => {
  const port = (direction: "input" | "output", given: Partial<InstalledPort>): InstalledPort => ({
    name: "x",
    direction,
    type_text: "double",
    unit: "",
    mode: "asynchronous",
    doc: "",
    cell: null,
    writes: direction === "output",
    required: false,
    ...given,
  });
  const block = (of: string, ports: InstalledPort[]) => ({ label: of, source: of, ports });
  const installed = {
    instances: [
      {
        state: "running",
        blocks: [
          block("slow", [port("output", { cells: ["a", "b"] })]),
          block("fast", [port("input", { cell: "a" }), port("input", { cell: "c" })]),
        ],
      },
      { state: "running", blocks: [block("fast", [port("input", { cell: "b", mode: "ratio 20" }), port("output", { cell: "c" })])] },
      { state: "ended", blocks: [block("fast", [port("output", { cell: "z" })]), block("slow", [port("input", { cell: "z" })])] },
    ],
  } as unknown as InstalledInstances;
  expect(connectionsOf(installed)).toEqual([
    {
      from: "slow",
      to: "fast",
      cells: [
        { name: "a", mode: "asynchronous" },
        { name: "b", mode: "ratio 20" },
      ],
    },
  ]);
});
