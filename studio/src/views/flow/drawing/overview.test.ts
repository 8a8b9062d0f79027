// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Box } from "./drawing";
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
