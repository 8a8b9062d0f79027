// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Box } from "./drawing";
import { sizeOf, TITLE_EDGE, TITLE_LETTER, TITLE_LINE, titleSize } from "./drawing";
import { legibleFrom } from "./Overview";

const box = (title: string): Box => ({
  id: title,
  kind: "svv",
  title,
  about: "SVV",
  doc: "",
  ports: [],
  source: null,
  opens: null,
  findings: [],
});

test("a drawing of long names is begun nearer than one of short names, so that both can be read", () => {
  const [short, long] = [legibleFrom([box("gain")]), legibleFrom([box("gain"), box("ur5e.shoulder_lift.commanded_velocity")])];
  expect(short).toBeLessThan(long);
  expect(long).toBeLessThan(1);
});

test("a title is shown at a size at which its longest word fits into its box", () => {
  const [split, whole] = [titleSize(box("ur5e.shoulder_lift.commanded")), titleSize(box("ur5e_shoulderliftcommandedvelocity"))];
  expect(split).toBeGreaterThan(17);
  expect(whole).toBeLessThan(13);
});

test("a title is shown at a size at which all its lines fit into its box", () => {
  const of = box("ur5e.shoulder_pan.homed");
  // At the size at which its longest word is as wide as the box, it takes three lines, which are higher than the box.
  const widest = (sizeOf(of).width - TITLE_EDGE) / (TITLE_LETTER * "shoulder_".length);
  expect(3 * TITLE_LINE * widest).toBeGreaterThan(sizeOf(of).height);
  expect(2 * TITLE_LINE * titleSize(of)).toBeLessThanOrEqual(sizeOf(of).height);
  expect(titleSize(of)).toBeGreaterThan(17);
});
