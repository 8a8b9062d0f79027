// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { decodeFrame, type StreamChannel } from "./frame";
import { frameOf } from "./frames.testing";

const channels: StreamChannel[] = [
  { name: "a", type_text: "double", unit: "rad", components: 1 },
  { name: "b", type_text: "double[3]", unit: null, components: 3 },
];

const frame = () =>
  frameOf("scope-1", [
    { channel: 1, times_ns: [5, 2 ** 40 + 7], numbers: [9, 2 ** 33], values: [1, 2, 3, 4, 5, 6] },
    { channel: 0, lost: 2 ** 34, times_ns: [-3], numbers: [1], values: [0.1] },
  ]);

test("every value comes with its time and number, exactly", () => {
  const [b, a] = decodeFrame(frame(), channels);
  expect([...(b?.times_ns ?? [])]).toEqual([5, 2 ** 40 + 7]);
  expect([...(b?.numbers ?? [])]).toEqual([9, 2 ** 33]);
  expect([...(b?.values ?? [])]).toEqual([1, 2, 3, 4, 5, 6]);
  expect(b?.lost).toBe(0);
  expect(a?.lost).toBe(2 ** 34);
  expect([...(a?.times_ns ?? [])]).toEqual([-3]);
  expect([...(a?.values ?? [])]).toEqual([0.1]);
});

test("values that do not lie on a border of 8 bytes are read too", () => {
  const whole = frame();
  const moved = new Uint8Array(whole.byteLength + 3);
  moved.set(new Uint8Array(whole.buffer), 3);
  const [b] = decodeFrame(new DataView(moved.buffer, 3), channels);
  expect([...(b?.values ?? [])]).toEqual([1, 2, 3, 4, 5, 6]);
});

test("a frame that ends too early is refused wherever it ends", () => {
  const whole = frame().buffer;
  for (let size = 0; size < whole.byteLength; size += 1) {
    expect(() => decodeFrame(new DataView(whole, 0, size), channels), `${size} bytes`).toThrow(/a frame of the stream is malformed: /);
  }
});

test.each([
  ["not one", (view: DataView) => view.setUint32(0, 7, true), /begins with 7, not with 47534331/],
  ["its id too long", (view: DataView) => view.setUint32(4, 5000, true), /id of 5000 bytes is longer than the frame/],
  ["too many runs", (view: DataView) => view.setUint32(16, 3, true), /ends before run 3 of 3/],
  ["too few runs", (view: DataView) => view.setUint32(16, 1, true), /40 bytes remain after the last of 1 runs/],
  ["an unknown channel", (view: DataView) => view.setUint32(24, 2, true), /run 1 is of channel 2, but the subscription has 2/],
  [
    "too many values",
    (view: DataView) => view.setUint32(28, 2 ** 31, true),
    /run 1 \('b', 2147483648 values\) needs .* bytes, but only .* remain/,
  ],
] as const)("refused in words: %s", (_, spoil, words) => {
  const spoilt = frame();
  spoil(spoilt);
  expect(() => decodeFrame(spoilt, channels)).toThrow(words);
});
