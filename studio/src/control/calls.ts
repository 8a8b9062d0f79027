// SPDX-License-Identifier: Apache-2.0
import { type Asker, answer } from "./requests";
import type {
  Alarms,
  Configuration,
  DeviceState,
  Geometry,
  Installed,
  InstanceState,
  LogEntry,
  Mode,
  Names,
  Reading,
  Report,
  Statistics,
  SvvAbout,
  Value,
  VerbForm,
  VerbSummary,
} from "./shapes";

type Nothing = Record<string, never>;

/** Calls that only look: role `observe`. Each: its arguments, its result. */
export interface Looks {
  configuration: [Nothing, Configuration];
  statistics: [Nothing, Statistics];
  names: [Nothing, Names];
  alarms: [Nothing, Alarms];
  log: [{ since?: number }, LogEntry[]];
  svv_about: [{ name: string }, SvvAbout];
  library: [Nothing, unknown];
  verbs: [Nothing, VerbSummary[]];
  installed: [Nothing, Installed];
  verb_form: [{ name: string }, VerbForm];
  geometry: [{ device: string }, Geometry];
  device_state: [{ name: string }, DeviceState];
  device_parameter: [{ name: string; parameter: string }, Value];
  read: [{ names: string[] }, { time_ns: number; values: Record<string, Reading> }];
  history: [{ name: string; count: number }, unknown];
  report: [{ instance: number }, Report | null];
  state: [{ instance: number }, InstanceState];
  mode: [Nothing, Mode];
  check: [Record<string, unknown>, unknown];
  check_graph: [Record<string, unknown>, unknown];
  check_definition: [Record<string, unknown>, unknown];
  compatible: [Record<string, unknown>, unknown];
  now: [Nothing, number];
}

/** Calls that command: they take command first. */
export interface Orders {
  create: [Record<string, unknown>, number];
  start: [{ instance: number; values?: Record<string, Value>; limits?: { time_limit_ns?: number } }, null];
  set: [{ instance: number; values?: Record<string, Value> }, null];
  halt: [{ instance: number; timeout_ns?: number }, Report | null];
  suspend: [{ instance: number }, null];
  resume: [{ instance: number }, null];
  delete: [{ instance: number }, null];
  enable: [{ name: string }, number];
  disable: [{ name: string }, null];
  set_device_parameter: [{ name: string; parameter: string; value: Value }, null];
  write: [{ name: string; value: Value }, null];
  reset: [Nothing, null];
  pause: [{ devices?: string[] }, string[]];
  resume_program: [{ devices?: string[] }, string[]];
  set_mode: [{ mode: Mode }, null];
  acknowledge_alarms: [{ number?: number }, number];
  request: [{ source: string }, null];
  advance: [{ duration_ns: number }, unknown];
  define_verb: [Record<string, unknown>, null];
  svv: [{ name: string; type_text: string; unit?: string; initial?: Value; types?: Record<string, string> }, null];
}

/** How long one slice of a call that lasts may take, ms. */
const SLICE_MS = 1000;
/** The calls that last; under the others `slice_ms` is refused. */
const LASTING = new Set(["wait", "wait_enabled", "halt", "disable", "pause", "paused", "advance"]);

interface Waiting {
  waiting: true;
  go_on: { call: string; arguments: Record<string, unknown> };
}

/** Makes a call by its name; one that lasts is asked for slice by slice, until it is over or `signal` ends it. */
export async function call<T>(asker: Asker, name: string, args: object, signal?: AbortSignal): Promise<T> {
  let asked = { call: name, arguments: args as Record<string, unknown> };
  for (;;) {
    const body = LASTING.has(asked.call) ? { ...asked.arguments, slice_ms: SLICE_MS } : asked.arguments;
    const said = await answer<{ result: T } | Waiting>(asker, "POST", `/v1/call/${asked.call}`, body, signal);
    if (!("waiting" in said)) return said.result;
    asked = said.go_on;
  }
}
