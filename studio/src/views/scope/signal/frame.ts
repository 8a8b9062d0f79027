// SPDX-License-Identifier: Apache-2.0
// Binary frames of the topic `scope`, with every value of the channels at its full rate. All numbers are little-endian.
//
//   u32 magic, u32 length of the id, the id padded to 8 bytes, u32 number of runs, u32 0
//   each run: u32 channel, u32 count, u64 lost, count × (i64 time_ns, u64 number), count × components × f64

import { MAGIC } from "../../../control/stream";

/** A channel of a subscription: an SVV or private cell. `components` is the number of components of a value. */
export interface StreamChannel {
  name: string;
  type_text: string;
  unit: string | null;
  components: number;
}

/** Values of one channel in one frame. */
export interface Run {
  channel: number;
  /** Number of values stored since the previous frame that were not sent. */
  lost: number;
  times_ns: Float64Array;
  numbers: Float64Array;
  /** Values in order; the components of each value are contiguous. */
  values: Float64Array;
}

/** Thrown for a malformed frame, with the error and its position. */
export class MalformedFrame extends Error {
  constructor(what: string) {
    super(`a frame of the stream is malformed: ${what}`);
    this.name = "MalformedFrame";
  }
}

const RUN_HEAD = 16;
const TWO_32 = 2 ** 32;

/**
 * Decodes a complete frame. Times and numbers are exact below 2^53 (104 days in ns). Throws `MalformedFrame` if any part of the frame is
 * malformed.
 */
export function decodeFrame(frame: DataView, channels: readonly StreamChannel[]): Run[] {
  const body = bodyOf(frame);
  if (body + 8 > frame.byteLength) throw new MalformedFrame(`${frame.byteLength} bytes end before the number of runs`);
  const count = frame.getUint32(body, true);
  const runs: Run[] = [];
  let at = body + 8;
  for (let i = 0; i < count; i += 1) {
    const run = readRun(frame, at, i, count, channels);
    at = run.end;
    runs.push(run.run);
  }
  if (at !== frame.byteLength) throw new MalformedFrame(`${frame.byteLength - at} bytes remain after the last of ${count} runs`);
  return runs;
}

function bodyOf(frame: DataView): number {
  if (frame.byteLength < 8) throw new MalformedFrame(`it has ${frame.byteLength} bytes, but its header has 8`);
  const magic = frame.getUint32(0, true);
  if (magic !== MAGIC) throw new MalformedFrame(`it begins with ${magic.toString(16)}, not with ${MAGIC.toString(16)}`);
  const length = frame.getUint32(4, true);
  const body = 8 + 8 * Math.ceil(length / 8);
  if (body > frame.byteLength) throw new MalformedFrame(`its id of ${length} bytes is longer than the frame of ${frame.byteLength}`);
  return body;
}

function readRun(frame: DataView, at: number, i: number, of: number, channels: readonly StreamChannel[]): { run: Run; end: number } {
  if (at + RUN_HEAD > frame.byteLength) throw new MalformedFrame(`it ends before run ${i + 1} of ${of}`);
  const channel = frame.getUint32(at, true);
  const count = frame.getUint32(at + 4, true);
  const lost = unsigned(frame, at + 8);
  const about = channels[channel];
  if (!about) throw new MalformedFrame(`run ${i + 1} is of channel ${channel}, but the subscription has ${channels.length} channels`);
  const start = at + RUN_HEAD;
  const end = start + count * (16 + 8 * about.components);
  if (end > frame.byteLength) {
    throw new MalformedFrame(
      `run ${i + 1} ('${about.name}', ${count} values) needs ${end - start} bytes, but only ${frame.byteLength - start} remain`,
    );
  }
  const times_ns = new Float64Array(count);
  const numbers = new Float64Array(count);
  for (let k = 0; k < count; k += 1) {
    times_ns[k] = signed(frame, start + 16 * k);
    numbers[k] = unsigned(frame, start + 16 * k + 8);
  }
  return { run: { channel, lost, times_ns, numbers, values: floats(frame, start + 16 * count, count * about.components) }, end };
}

function unsigned(frame: DataView, at: number): number {
  return frame.getUint32(at + 4, true) * TWO_32 + frame.getUint32(at, true);
}

function signed(frame: DataView, at: number): number {
  return frame.getInt32(at + 4, true) * TWO_32 + frame.getUint32(at, true);
}

const LITTLE = new Uint8Array(new Uint16Array([1]).buffer)[0] === 1;

function floats(frame: DataView, at: number, count: number): Float64Array {
  const start = frame.byteOffset + at;
  if (LITTLE && start % 8 === 0) return new Float64Array(frame.buffer as ArrayBuffer, start, count);
  const values = new Float64Array(count);
  for (let k = 0; k < count; k += 1) values[k] = frame.getFloat64(at + 8 * k, true);
  return values;
}
