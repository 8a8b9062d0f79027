// SPDX-License-Identifier: Apache-2.0
import react from "@vitejs/plugin-react";
import { defineConfig } from "vitest/config";

/** The running real-time system that `npm run dev` talks to: `opengpac rts PROGRAM.py --listen 127.0.0.1:8777 --tokens tokens.json`. */
const system = process.env.OPENGPAC_URL ?? "http://127.0.0.1:8777";

export default defineConfig({
  plugins: [react()],
  build: {
    // The wheel carries it, and the control interface serves it from there.
    outDir: "../python/opengpac/studio_page",
    emptyOutDir: true,
    target: "es2023",
    // elkjs and three are loaded with the views that need them.
    chunkSizeWarningLimit: 1700,
  },
  server: {
    host: "127.0.0.1",
    port: 5173,
    proxy: {
      "/v1": {
        target: system,
        changeOrigin: true,
        ws: true,
        // The page's origin is the development server's, which the system does not know.
        configure: (proxy) => {
          proxy.on("proxyReq", (request) => request.removeHeader("origin"));
          proxy.on("proxyReqWs", (request) => request.removeHeader("origin"));
        },
      },
    },
  },
  test: { include: ["src/**/*.test.ts"], environment: "node", testTimeout: 60_000 },
});
