// SPDX-License-Identifier: Apache-2.0

/**
 * Maximum number of concurrent background requests. A browser allows six connections to a host for all of its pages: this leaves one for
 * the heartbeat and two for requests that stop or move something, which never queue here.
 */
const PLACES = 3;

let free = PLACES;
const waiting: (() => void)[] = [];

/** Calls `work` as soon as a slot is free. Throws the errors of `work`, or the signal's reason if the signal aborts the wait. */
export async function inTurn<T>(work: () => Promise<T>, signal?: AbortSignal): Promise<T> {
  await place(signal);
  try {
    return await work();
  } finally {
    free += 1;
    waiting.shift()?.();
  }
}

function place(signal?: AbortSignal): Promise<void> {
  if (free > 0) {
    free -= 1;
    return Promise.resolve();
  }
  return new Promise((take, refuse) => {
    const next = () => {
      signal?.removeEventListener("abort", leave);
      free -= 1;
      take();
    };
    const leave = () => {
      waiting.splice(waiting.indexOf(next), 1);
      refuse(signal?.reason);
    };
    if (signal?.aborted) return refuse(signal.reason);
    signal?.addEventListener("abort", leave, { once: true });
    waiting.push(next);
  });
}
