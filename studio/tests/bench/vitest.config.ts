// SPDX-License-Identifier: Apache-2.0
import { defineConfig } from "vitest/config";

/** Measurements for a quiet machine, printed by `npm run bench`. */
export default defineConfig({
  root: import.meta.dirname,
  test: { include: ["*.test.ts"], environment: "node", fileParallelism: false, expect: { poll: { timeout: 90_000 } } },
});
