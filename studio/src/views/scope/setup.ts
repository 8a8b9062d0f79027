// SPDX-License-Identifier: Apache-2.0
// Setup of a scope: its traces and their display; stored by name, sent as a link.

import { tr } from "../../language/text";
import { formula } from "./signal/formula";
import { AMOUNTS, type SpectrumSetup, WINDOW_FUNCTIONS } from "./signal/spectrum";
import type { SweepMode } from "./signal/sweep";
import type { Edge } from "./signal/trigger";

/** A component of a channel: `[2]` for `arm.force`, `""` for a scalar; null for all components. */
export interface Source {
  channel: string;
  component: string | null;
}

export interface TraceSetup extends Source {
  /** Quantity derived from the value, shown in its place. */
  derive?:
    | { kind: "derivative" }
    | { kind: "difference"; less: { channel: string; component: string } }
    // `of` contains the traces named in the formula, in order; the first is `channel` and `component` of this trace.
    | { kind: "formula"; text: string; of: { channel: string; component: string }[] };
  /** Index of the colour and line pattern. */
  look: number;
  hidden?: boolean;
  /** Index of the plot, from the top; 0 by default. */
  plot?: number;
  /** Fixed range of the scale; if absent, the range follows the values. */
  range?: [number, number];
}

/**
 * `unit`: traces with the same unit share a scale. `own`: each trace has its own scale. `lanes`: each trace has its own scale, in a
 * separate lane.
 */
export type ScaleMode = "unit" | "own" | "lanes";

export type TriggerSetup =
  | { on: "level"; channel: string; component: string; edge: Edge; level: number; hysteresis: number }
  | { on: "event"; kind: string; about: string; text: string };

export interface Setup {
  traces: TraceSetup[];
  sweep: SweepMode;
  /** Time span shown on the screen, and the part of it before the trigger, s. */
  span_s: number;
  pre_s: number;
  trigger: TriggerSetup | null;
  scales: ScaleMode;
  /** Name of the trace shown along x; null for time. */
  xy: string | null;
  /** Settings of the spectra of the shown span, if the x axis is frequency; null for time. */
  spectrum: SpectrumSetup | null;
  /** True if lines are drawn as steps, which hold each value until the next one. */
  steps: boolean;
  /** Length of the stored history, s. */
  keep_s: number;
}

export const EMPTY: Setup = {
  traces: [],
  sweep: "roll",
  span_s: 5,
  pre_s: 0.2,
  trigger: null,
  scales: "unit",
  xy: null,
  spectrum: null,
  steps: false,
  keep_s: 60,
};

/** Returns the name by which a trace is identified. */
export function traceId(trace: TraceSetup): string {
  const name = `${trace.channel}${trace.component ?? ""}`;
  if (trace.derive?.kind === "derivative") return `d/dt ${name}`;
  if (trace.derive?.kind === "difference") return `${name} − ${trace.derive.less.channel}${trace.derive.less.component}`;
  if (trace.derive?.kind === "formula") return trace.derive.text;
  return name;
}

/** Returns the indices of the plots that contain a trace, from the top. With lanes, or with a trace along x, only plot 0 exists. */
export function plotsOf(setup: Setup): number[] {
  if (setup.scales === "lanes" || setup.xy !== null) return [0];
  const used = [...new Set(setup.traces.filter((trace) => !trace.hidden).map((trace) => trace.plot ?? 0))].sort((a, b) => a - b);
  return used.length > 0 ? used : [0];
}

/** Returns the unit of a trace, given the unit of its channel; null if it has none, or for a formula, whose unit is unknown. */
export function unitOf(trace: TraceSetup, unit: string | null): string | null {
  if (trace.derive?.kind === "formula") return null;
  return trace.derive?.kind === "derivative" ? `${unit ?? "1"}/s` : unit;
}

/** Returns the channels that a setup needs. */
export function channelsOf(setup: Setup): string[] {
  const names = setup.traces.map((trace) => trace.channel);
  for (const { derive } of setup.traces) {
    if (derive?.kind === "difference") names.push(derive.less.channel);
    if (derive?.kind === "formula") names.push(...derive.of.map(({ channel }) => channel));
  }
  if (setup.trigger?.on === "level") names.push(setup.trigger.channel);
  return [...new Set(names)];
}

/** Returns the first look (colour and line pattern) that no trace uses. */
export function freeLook(traces: readonly TraceSetup[]): number {
  const used = new Set(traces.map((trace) => trace.look));
  let look = 0;
  while (used.has(look)) look += 1;
  return look;
}

/** Adds a channel with all its components, unless it is already shown. */
export function withChannel(setup: Setup, channel: string, component: string | null = null): Setup {
  const there = setup.traces.some(
    (trace) => trace.channel === channel && !trace.derive && (component === null || trace.component === component),
  );
  if (there) return setup;
  return { ...setup, traces: [...setup.traces, { channel, component, look: freeLook(setup.traces) }] };
}

/** Adds a formula over traces. Throws an `Error` that states the syntax error or the missing trace. */
export function withFormula(setup: Setup, text: string): Setup {
  const { names } = formula(text);
  const plain = setup.traces.filter((trace) => !trace.derive && trace.component !== null);
  const of = names.map((name) => {
    const found = plain.find((trace) => traceId(trace) === name);
    if (!found)
      throw new Error(
        tr("scope.noTraceNameIsOnThe", {
          name,
          part: plain.length > 0 ? tr("scope.chooseOneOf", { value: plain.map(traceId).join(", ") }) : "",
        }),
      );
    return { channel: found.channel, component: found.component ?? "" };
  });
  const first = of[0] as { channel: string; component: string };
  const made: TraceSetup = { ...first, look: freeLook(setup.traces), derive: { kind: "formula", text, of } };
  if (setup.traces.some((trace) => traceId(trace) === traceId(made))) return setup;
  return { ...setup, traces: [...setup.traces, made] };
}

/** Returns the setup as a URL parameter: `?setup=…`. */
export function toLink(setup: Setup): string {
  const said = Object.fromEntries(
    Object.entries(setup).filter(([key, value]) => JSON.stringify(value) !== JSON.stringify(EMPTY[key as keyof Setup])),
  );
  return JSON.stringify(said);
}

/**
 * Parses the setup from a link's parameter `setup`, or only from `names`; null if the link has neither. Throws an `Error` that describes
 * the mistake.
 */
export function fromLink(query: URLSearchParams): Setup | null {
  const said = query.get("setup");
  const names = query.get("names");
  if (said) return checked(parsed(said));
  if (!names) return null;
  return names
    .split(",")
    .filter(Boolean)
    .reduce((setup, name) => withChannel(setup, name), EMPTY);
}

function parsed(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    throw new Error(tr("scope.theLinkContainsAnIncompleteSetup"));
  }
}

/** Maximum number of plots. */
export const PLOTS_MAX = 6;

const SWEEPS = ["roll", "auto", "normal", "single"];
const SCALES = ["unit", "own", "lanes"];

/** Validates a setup and adds missing members. Throws an `Error` that describes the mistake. */
export function checked(said: unknown): Setup {
  if (typeof said !== "object" || said === null) throw new Error(tr("scope.aSetupOfTheScopeMust"));
  const setup = { ...EMPTY, ...said } as Setup;
  const wrong = (what: string): never => {
    throw new Error(tr("scope.theSetupOfTheScopeIs", { what }));
  };
  if (!Array.isArray(setup.traces)) wrong(tr("scope.tracesIsNotAList"));
  setup.traces.forEach((trace, i) => {
    if (typeof trace?.channel !== "string" || trace.channel === "") wrong(tr("scope.traceIDoesNotNameA", { i: i + 1 }));
    if (trace.plot !== undefined && !(Number.isInteger(trace.plot) && trace.plot >= 0 && trace.plot < PLOTS_MAX))
      wrong(tr("scope.thePlotOfTraceIMust", { i: i + 1, PLOTS_MAX: PLOTS_MAX - 1, plot: trace.plot }));
    if (trace.derive?.kind === "formula" && formula(String(trace.derive.text)).names.length !== trace.derive.of?.length)
      wrong(tr("scope.theNamesInTheFormulaOf", { i: i + 1 }));
  });
  if (!SWEEPS.includes(setup.sweep)) wrong(tr("scope.sweepMustBeOneOfSWEEPS", { SWEEPS: SWEEPS.join(", "), sweep: setup.sweep }));
  if (!SCALES.includes(setup.scales)) wrong(tr("scope.scalesMustBeOneOfSCALES", { SCALES: SCALES.join(", "), scales: setup.scales }));
  const { spectrum } = setup;
  if (spectrum && !WINDOW_FUNCTIONS.includes(spectrum.window))
    wrong(tr("scope.theWindowFunctionMustBeOne", { WINDOW_FUNCTIONS: WINDOW_FUNCTIONS.join(", "), window: spectrum.window }));
  if (spectrum && !AMOUNTS.includes(spectrum.amount))
    wrong(tr("scope.amountOfTheSpectrumMustBe", { AMOUNTS: AMOUNTS.join(", "), amount: spectrum.amount }));
  if (spectrum && !(spectrum.to_hz === null || spectrum.to_hz > 0)) wrong(tr("scope.toHzMustBeMoreThan", { to_hz: spectrum.to_hz }));
  const { from_hz = 0, to_hz = null } = spectrum ?? {};
  if (!(from_hz >= 0 && from_hz < (to_hz ?? Number.POSITIVE_INFINITY))) wrong(tr("scope.fromHzMustBeAtLeast", { from_hz }));
  if (!(setup.span_s >= 1e-6 && setup.span_s <= 600)) wrong(tr("scope.spanSMustBeFrom0", { span_s: setup.span_s }));
  if (!(setup.pre_s >= 0)) wrong(tr("scope.preSMustBeAtLeast", { pre_s: setup.pre_s }));
  if (!(setup.keep_s >= 1 && setup.keep_s <= 600)) wrong(tr("scope.keepSMustBeFrom1", { keep_s: setup.keep_s }));
  return { ...setup, traces: setup.traces.map((trace) => ({ ...trace, component: trace.component ?? null, look: trace.look ?? 0 })) };
}
