// SPDX-License-Identifier: Apache-2.0
import { tr } from "../language/text";
import { RefusalError, refusedBy, unreachable } from "./refusals";
import { inTurn } from "./room";

/** Sender of a request: its authentication token and its session. */
export interface Asker {
  token: string | null;
  session: string | null;
  /** Time on the daemon's clock at which the command was given, ms. The daemon refuses a command that arrives too late. */
  asOf?: number;
  /** True if the request stops or moves something, so that it must not queue behind other requests of the page. */
  isFirst?: boolean;
  /** True if the request must not wait until the system has capacity: a refusal for lack of capacity is returned immediately. */
  isUrgent?: boolean;
}

/** Maximum number of attempts if the system has no capacity, and the maximum wait between two attempts, s. */
const TRIES = 3;
const AGAIN_MAX_S = 2;

/** Sends one request to the control interface, and returns its `result`. Throws `RefusalError`. */
export async function request<T>(asker: Asker, method: string, path: string, body?: unknown, signal?: AbortSignal): Promise<T> {
  return (await answer<{ result: T }>(asker, method, path, body, signal)).result;
}

/** Sends one request, and returns the complete answer. Throws `RefusalError`, or `AbortError` if `signal` aborts it. */
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
    // Without capacity, nothing was done: the request is repeated after the time that the system states.
    if (status !== 429 || asker.isUrgent || tries + 1 === TRIES) break;
    await new Promise((wait) => setTimeout(wait, 1000 * Math.min(Number(again) || 1, AGAIN_MAX_S)));
  }
  if (status >= 400) throw refusedBy(status, text);
  try {
    return JSON.parse(text) as T;
  } catch {
    throw new RefusalError([{ class: "Error", message: tr("control.theAnswerToMethodPathIs", { method, path }) }], status);
  }
}
