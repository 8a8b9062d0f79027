// SPDX-License-Identifier: Apache-2.0
// Frames as the system sends them, for tests.
import { MAGIC } from "../../../control/stream";
import type { Run } from "./frame";

export interface MadeRun {
  channel: number;
  lost?: number;
  times_ns: number[];
  numbers: number[];
  values: number[];
}

/** Encodes a frame with these runs. */
export function frameOf(id: string, runs: MadeRun[]): DataView<ArrayBuffer> {
  const name = new TextEncoder().encode(id);
  const body = 8 + 8 * Math.ceil(name.length / 8);
  const size = runs.reduce((sum, run) => sum + 16 + 16 * run.times_ns.length + 8 * run.values.length, body + 8);
  const frame = new DataView(new ArrayBuffer(size));
  frame.setUint32(0, MAGIC, true);
  frame.setUint32(4, name.length, true);
  new Uint8Array(frame.buffer, 8, name.length).set(name);
  frame.setUint32(body, runs.length, true);
  let at = body + 8;
  for (const run of runs) {
    frame.setUint32(at, run.channel, true);
    frame.setUint32(at + 4, run.times_ns.length, true);
    frame.setBigUint64(at + 8, BigInt(run.lost ?? 0), true);
    at += 16;
    run.times_ns.forEach((time_ns, i) => {
      frame.setBigInt64(at, BigInt(time_ns), true);
      frame.setBigUint64(at + 8, BigInt(run.numbers[i] as number), true);
      at += 16;
    });
    for (const value of run.values) {
      frame.setFloat64(at, value, true);
      at += 8;
    }
  }
  return frame;
}

/** Returns a run of one component, in decoded form. */
export function runOf(times_ns: number[], values: number[], numbers: number[] = times_ns.map((_, i) => i + 1), lost = 0): Run {
  return {
    channel: 0,
    lost,
    times_ns: Float64Array.from(times_ns),
    numbers: Float64Array.from(numbers),
    values: Float64Array.from(values),
  };
}

/** Returns a generator of pseudo-random numbers; the sequence is the same in every test run. */
export function random(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}
