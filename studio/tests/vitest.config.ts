// SPDX-License-Identifier: Apache-2.0
import { defineConfig } from "vitest/config";

/** The page in a real browser, against a running system: one file after the other, for each has a system of its own. */
export default defineConfig({
  root: import.meta.dirname,
  test: {
    include: ["*.test.ts"],
    environment: "node",
    fileParallelism: false,
    testTimeout: 400_000,
    hookTimeout: 120_000,
    expect: { poll: { timeout: 90_000 } },
  },
});
