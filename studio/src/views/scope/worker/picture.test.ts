// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Show, ShownTrace } from "../messages";
import { lane } from "./picture";

/** Returns the texts that are drawn in a lane of this height. */
function textsOf(height: number): string[] {
  const texts: string[] = [];
  const canvas = {
    fillRect: () => {},
    save: () => {},
    restore: () => {},
    measureText: () => ({ width: 40 }),
    fillText: (text: string) => texts.push(text),
  };
  const trace = { id: "arm.elbow.sensed", unit: "rad", colour: "red" } as ShownTrace;
  const show = { width: 800, ratio: 2, font: "", ink: { quiet: "", ground: "" } } as unknown as Show;
  lane(canvas as unknown as Parameters<typeof lane>[0], trace, { lo: -1, hi: 1, top: 100, bottom: 100 + height }, 1, show);
  return texts;
}

test("a lane keeps the name of its trace, its range and unit, as long as there is room for a line", () => {
  expect(textsOf(200)).toEqual([expect.stringMatching(/^arm\.elbow\.sensed {2}-1.* 1.* rad$/)]);
  expect(textsOf(28)).toHaveLength(1);
  expect(textsOf(20)).toEqual([]);
});
