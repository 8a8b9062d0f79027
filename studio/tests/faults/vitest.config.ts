// SPDX-License-Identifier: Apache-2.0
import { defineConfig } from "vitest/config";

/** Long tests, or those for a quiet machine: `make faults`. The files run one after the other, because each measures. */
export default defineConfig({
  root: import.meta.dirname,
  test: { include: ["*.test.ts"], environment: "node", fileParallelism: false, expect: { poll: { timeout: 90_000 } } },
});
