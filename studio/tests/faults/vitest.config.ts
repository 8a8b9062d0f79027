// SPDX-License-Identifier: Apache-2.0
import { defineConfig } from "vitest/config";

/** What takes long: `make faults`. */
export default defineConfig({ root: import.meta.dirname, test: { include: ["*.test.ts"], environment: "node" } });
