// SPDX-License-Identifier: Apache-2.0
import { type Asker, answer } from "./requests";
import { type Calls, LASTING } from "./shapes";

/** The calls that the role `observe` may make, or those that it may not. Each: its arguments, its result. */
type Of<Looking extends boolean> = {
  [Name in keyof Calls as (Calls[Name]["role"] extends "observe" ? true : false) extends Looking ? Name : never]: [
    Calls[Name]["arguments"],
    Calls[Name]["result"],
  ];
};

/** Calls that only look. */
export type Looks = Of<true>;
/** Calls that command: they take command first. */
export type Orders = Of<false>;

/** Time limit of one slice of a call that lasts, ms. */
const SLICE_MS = 1000;

/** Calls that stop something. They need no command, and have stopped it when their first answer comes. */
export type Stops = Pick<Orders, "halt" | "suspend" | "disable" | "pause">;

/** Calls that neither need command nor take it, for they leave the machine alone: a replay beside it, what is kept for people, alarms. */
export type Asides = Pick<
  Orders,
  "replay" | "stop_replay" | "keep_workspace" | "forget_workspace" | "acknowledge_alarms" | "shelve_alarm" | "unshelve_alarm"
>;

interface WaitingAnswer {
  waiting: true;
  go_on: { call: string; arguments: Record<string, unknown> };
}

/** Makes a call by its name; one that lasts is asked for slice by slice, until it is over or `signal` ends it. */
export async function call<T>(asker: Asker, name: string, args: object, signal?: AbortSignal): Promise<T> {
  let asked = { call: name, arguments: args as Record<string, unknown> };
  let by = asker;
  for (;;) {
    const body = LASTING.has(asked.call) ? { ...asked.arguments, slice_ms: SLICE_MS } : asked.arguments;
    const said = await answer<{ result: T } | WaitingAnswer>(by, "POST", `/v1/call/${asked.call}`, body, signal);
    if (!("waiting" in said)) return said.result;
    asked = said.go_on;
    // What goes on has begun in time.
    by = { token: asker.token, session: asker.session };
  }
}

/** Makes a call that stops something: one request. What it stops has begun to stop then; its end is told by what comes by itself. */
export async function stop<N extends keyof Stops>(asker: Asker, name: N, args: Stops[N][0]): Promise<void> {
  const body = LASTING.has(name) ? { ...args, slice_ms: SLICE_MS } : args;
  await answer(asker, "POST", `/v1/call/${name}`, body);
}
