// SPDX-License-Identifier: Apache-2.0
import type { ELK } from "elkjs/lib/elk-api";

let made: Promise<ELK> | null = null;

/** The layout of drawings, loaded when it is first needed. */
export function elk(): Promise<ELK> {
  // The page ships one of the two: what is not of a production build is left out of it.
  made ??= import.meta.env.PROD ? inWorker() : inPlace();
  return made;
}

// In a worker of its own: a graph of hundreds of blocks does not hold up the page.
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
