// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { nodeId, nodeName } from "./nodeIds";

test("an id stands in a selector, whatever the name, and leads back to it", () => {
  for (const name of ["ünit \"'", "a\\b", "25 %", "%22", "two\nlines", "move#1/servo", "inputs:x"]) {
    const id = nodeId(name);
    expect(id).not.toMatch(/["\\\n\r\f]/);
    expect(nodeName(id)).toBe(name);
  }
  expect(nodeId("move#1/servo.pid")).toBe("move#1/servo.pid");
});
