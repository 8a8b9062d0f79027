// SPDX-License-Identifier: Apache-2.0
import { type Asker, answer } from "./requests";
import { type Calls, LASTING } from "./shapes";

/** The calls that the role `observe` may make if `Looking` is true, otherwise all other calls. Each has its arguments and its result. */
type Of<Looking extends boolean> = {
  [Name in keyof Calls as (Calls[Name]["role"] extends "observe" ? true : false) extends Looking ? Name : never]: [
    Calls[Name]["arguments"],
    Calls[Name]["result"],
  ];
};

/** Read-only calls. */
export type Looks = Of<true>;
/** Calls that command the system. The page takes command before such a call. */
export type Orders = Of<false>;

/** Maximum duration of one slice of a long-running call, ms. */
const SLICE_MS = 1000;

/** Calls that stop something. They do not require command, and take effect before they return for the first time. */
export type Stops = Pick<Orders, "halt" | "suspend" | "disable" | "pause">;

/** Calls that neither require command nor take it, because they do not affect the machine: replays, stored workspaces, alarms. */
export type Asides = Pick<
  Orders,
  "replay" | "stop_replay" | "keep_workspace" | "forget_workspace" | "acknowledge_alarms" | "shelve_alarm" | "unshelve_alarm"
>;

interface WaitingAnswer {
  waiting: true;
  go_on: { call: string; arguments: Record<string, unknown> };
}

/** Makes a call by name. A long-running call is repeated in slices until it finishes or `signal` aborts it. */
export async function call<T>(asker: Asker, name: string, args: object, signal?: AbortSignal): Promise<T> {
  let asked = { call: name, arguments: args as Record<string, unknown> };
  let by = asker;
  for (;;) {
    const body = LASTING.has(asked.call) ? { ...asked.arguments, slice_ms: SLICE_MS } : asked.arguments;
    const said = await answer<{ result: T } | WaitingAnswer>(by, "POST", `/v1/call/${asked.call}`, body, signal);
    if (!("waiting" in said)) return said.result;
    asked = said.go_on;
    // Only the first slice carries the time of the command: it has begun in time.
    by = { token: asker.token, session: asker.session };
  }
}

/**
 * Makes a call that stops something, as a single request. When the request returns, the stop has begun; its completion is reported
 * through the topics.
 */
export async function stop<N extends keyof Stops>(asker: Asker, name: N, args: Stops[N][0]): Promise<void> {
  const body = LASTING.has(name) ? { ...args, slice_ms: SLICE_MS } : args;
  await answer(asker, "POST", `/v1/call/${name}`, body);
}
