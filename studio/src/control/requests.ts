// SPDX-License-Identifier: Apache-2.0
import { RefusalError, refusedBy, unreachable } from "./refusals";
import { inTurn } from "./room";

/** Sender of a request: the token that lets it in, and the session that it has opened. */
export interface Asker {
  token: string | null;
  session: string | null;
  /** The daemon's time at which what is asked was given, ms: the daemon refuses it where it comes late. */
  asOf?: number;
  /** Does not wait for its turn among the page's requests: it stops or moves something. */
  isFirst?: boolean;
  /** Neither waits for room in the system: the answer that there is none comes back at once. */
  isUrgent?: boolean;
}

/** Number of tries of a request for which there is no room, and the longest time between, s. */
const TRIES = 3;
const AGAIN_MAX_S = 2;

/** One request of the control interface; its `result`. Errors: `RefusalError`. */
export async function request<T>(asker: Asker, method: string, path: string, body?: unknown, signal?: AbortSignal): Promise<T> {
  return (await answer<{ result: T }>(asker, method, path, body, signal)).result;
}

/** One request; the whole answer. Errors: `RefusalError`, or `AbortError` where `signal` says so. */
export async function answer<T>(asker: Asker, method: string, path: string, body?: unknown, signal?: AbortSignal): Promise<T> {
  const headers: Record<string, string> = {};
  if (asker.token) headers.Authorization = `Bearer ${asker.token}`;
  if (asker.session) headers["OpenGPAC-Session"] = asker.session;
  if (asker.asOf !== undefined) headers["OpenGPAC-As-Of"] = String(asker.asOf);
  const asked: RequestInit = { method, headers, cache: "no-store" };
  if (body !== undefined) asked.body = JSON.stringify(body);
  if (signal) asked.signal = signal;
  let status = 0;
  let text = "";
  for (let tries = 0; tries < TRIES; tries += 1) {
    let again: string | null;
    const once = async () => {
      const response = await fetch(path, asked);
      return { status: response.status, text: await response.text(), again: response.headers.get("Retry-After") };
    };
    try {
      ({ status, text, again } = await (asker.isFirst || asker.isUrgent ? once() : inTurn(once, signal)));
    } catch (why) {
      if (signal?.aborted) throw why;
      throw unreachable(why);
    }
    // Where there was no room for it, nothing was done: it is asked again when the system says.
    if (status !== 429 || asker.isUrgent || tries + 1 === TRIES) break;
    await new Promise((wait) => setTimeout(wait, 1000 * Math.min(Number(again) || 1, AGAIN_MAX_S)));
  }
  if (status >= 400) throw refusedBy(status, text);
  try {
    return JSON.parse(text) as T;
  } catch {
    throw new RefusalError([{ class: "Error", message: `${method} ${path} was not answered in JSON` }], status);
  }
}
