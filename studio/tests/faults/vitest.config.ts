// SPDX-License-Identifier: Apache-2.0
import { defineConfig } from "vitest/config";

/** What takes long, or a quiet machine: `make faults`. One file after the other, for each measures. */
export default defineConfig({
  root: import.meta.dirname,
  test: { include: ["*.test.ts"], environment: "node", fileParallelism: false, expect: { poll: { timeout: 90_000 } } },
});
