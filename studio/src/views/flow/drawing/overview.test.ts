// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Box } from "./drawing";
import { titleSize } from "./drawing";
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
  expect(split).toBeGreaterThan(20);
  expect(whole).toBeLessThan(13);
});
