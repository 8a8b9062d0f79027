// SPDX-License-Identifier: Apache-2.0

/**
 * Maximum number of requests under way at once that no hand waits for. A browser has six connections to a host, for all of its pages: this leaves one
 * for the sign of life and two for what stops or moves something, which never wait here.
 */
const PLACES = 3;

let free = PLACES;
const waiting: (() => void)[] = [];

/** Does `work` as soon as there is a place. Errors: those of `work`; the signal's reason where it is given up before that. */
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
