// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { RecordedSpan } from "../../control/shapes";
import type { Past } from "../../control/source";
import { VALUES_MAX, wholeOf } from "./whole";

const CHANNEL = { name: "q", type_text: "double", unit: "rad", components: 1 };

/** Returns a channel with a value at each of these times, reduced to columns as the recorder does: first, last, minimum, maximum. */
function pastOf(times_ns: number[]): Pick<Past, "span"> {
  return {
    async *span(_names, from_ns, to_ns, columns) {
      const width = Math.max(1, Math.floor((to_ns - from_ns) / columns));
      const inside = times_ns.filter((time) => time >= from_ns && time <= to_ns);
      const before = times_ns.filter((time) => time < from_ns).slice(-1);
      const by = new Map<number, number[]>();
      for (const time of inside)
        by.set(Math.floor((time - from_ns) / width), [...(by.get(Math.floor((time - from_ns) / width)) ?? []), time]);
      // The value is the time, so the first value is the minimum and the last the maximum.
      const kept = [...before, ...[...by.values()].flatMap((all) => [...new Set([all[0] as number, all.at(-1) as number])])];
      const view = new DataView(new ArrayBuffer(24 * kept.length));
      kept.forEach((time, at) => {
        view.setBigInt64(16 * at, BigInt(time), true);
        view.setBigUint64(16 * at + 8, BigInt(times_ns.indexOf(time)), true);
        view.setFloat64(16 * kept.length + 8 * at, time, true);
      });
      const samples = btoa(Array.from(new Uint8Array(view.buffer), (byte) => String.fromCharCode(byte)).join(""));
      const sums = { count: inside.length, min: 0, max: 0, sum: 0, squares: 0, spread: 0 };
      yield { channels: [{ samples, sums: [sums] }], next: null } satisfies RecordedSpan;
    },
  };
}

async function timesOf(past: Pick<Past, "span">, from_ns: number, to_ns: number): Promise<number[]> {
  const found: number[] = [];
  for await (const runs of wholeOf(past, [CHANNEL], from_ns, to_ns, new AbortController().signal)) {
    for (const run of runs) found.push(...run.times_ns);
  }
  return found;
}

test("every value comes once and in order, however densely the values lie", async () => {
  // A thousand values per second, and a burst that no column of the first request can hold.
  const times = [...Array.from({ length: 2000 }, (_, i) => i * 1_000_000), ...Array.from({ length: 500 }, (_, i) => 700_000_001 + i * 10)];
  times.sort((one, other) => one - other);
  expect(await timesOf(pastOf(times), 0, 2_000_000_000)).toEqual(times);
  const some = times.filter((time) => time >= 500_500_000 && time <= 900_000_000);
  expect(await timesOf(pastOf(times), 500_500_000, 900_000_000)).toEqual(some);
});

test("too many values are refused with what to do", async () => {
  const past: Pick<Past, "span"> = {
    async *span() {
      const sums = { count: VALUES_MAX + 1, min: 0, max: 0, sum: 0, squares: 0, spread: 0 };
      yield { channels: [{ samples: "", sums: [sums] }], next: null };
    },
  };
  await expect(timesOf(past, 0, 1e12)).rejects.toThrow("choose a shorter interval");
});
