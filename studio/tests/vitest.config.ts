// SPDX-License-Identifier: Apache-2.0
import { defineConfig } from "vitest/config";

/** The page in a real browser, against a running system: the files run one after the other, because each has its own system. */
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
