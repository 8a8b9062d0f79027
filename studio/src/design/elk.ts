// SPDX-License-Identifier: Apache-2.0
import type { ELK } from "elkjs/lib/elk-api";

let made: Promise<ELK> | null = null;

/** Returns the layout engine for drawings, which is loaded on first use. */
export function elk(): Promise<ELK> {
  // A production build includes only one of the two.
  made ??= import.meta.env.PROD ? inWorker() : inPlace();
  return made;
}

// Runs in its own worker, so that a graph of hundreds of blocks does not block the page.
async function inWorker(): Promise<ELK> {
  const [{ default: Elk }, worker] = await Promise.all([
    import("elkjs/lib/elk-api"),
    import("elkjs/lib/elk-worker.min.js?worker") as Promise<{ default: new () => Worker }>,
  ]);
  return new Elk({ workerFactory: () => new worker.default() });
}

async function inPlace(): Promise<ELK> {
  const { default: Elk } = await import("elkjs/lib/elk.bundled.js");
  return new Elk();
}
