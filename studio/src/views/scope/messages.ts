// SPDX-License-Identifier: Apache-2.0
// Messages between the page and the worker of the scope.

import type { RecordedSums as Sums } from "../../control/shapes";
import type { ScaleMode, TraceSetup } from "./setup";
import type { Run, StreamChannel } from "./signal/frame";
import type { Measures } from "./signal/measure";
import type { Range } from "./signal/ranges";
import type { SpectrumSetup } from "./signal/spectrum";
import type { Span, SweepMode, SweepState } from "./signal/sweep";
import type { Edge } from "./signal/trigger";

export interface TriggerRule {
  channel: string;
  component: string;
  edge: Edge;
  level: number;
  hysteresis: number;
}

/** A trace with all its components named, as it is drawn. */
export interface ShownTrace {
  id: string;
  setup: TraceSetup;
  colour: string;
  pattern: number[];
  unit: string | null;
}

/** Times of the screen; null: what the sweep says. */
export type Window = { from_ns: number; to_ns: number; origin_ns: number; triggered: boolean } | null;

/** A plot in the picture. */
export interface Band {
  plot: number;
  top: number;
  height: number;
}

export interface Show {
  /** Pixels of the plot, and how many of them are one of CSS. Width 0: nothing is drawn. */
  width: number;
  height: number;
  ratio: number;
  window: Window;
  traces: ShownTrace[];
  scales: ScaleMode;
  steps: boolean;
  xy: string | null;
  /** Frequency along x instead of time. */
  spectrum: SpectrumSetup | null;
  /** Of a recording spectra are of values that came for them, all of the span. */
  recorded: boolean;
  /** Where each plot lies in the picture, from the top. */
  plots: Band[];
  /** Relative to the origin of the axis, s. */
  cursors: [number, number] | null;
  ink: { text: string; quiet: string; bad: string; warn: string; ground: string };
  font: string;
  marker: { channel: string; component: string; level: number } | null;
}

/** Destination of values of a recording: the screen, what lies behind it, spectra of both, a file. */
export type Into = "shown" | "beside" | "whole" | "wholeBeside" | "file";
export type Format = "csv" | "mcap" | "svg";

export type ToWorker =
  | { kind: "subscribed"; subscription: number; channels: StreamChannel[]; again: boolean }
  | { kind: "frame"; subscription: number; buffer: ArrayBuffer }
  | { kind: "past"; into: Into; begins: boolean; channels: StreamChannel[]; runs: Run[]; sums: Sums[][] }
  | { kind: "forget"; channels: string[] }
  | { kind: "keep"; keep_s: number }
  | { kind: "sweep"; mode: SweepMode; span_ns: number; pre_ns: number; trigger: TriggerRule | null }
  | { kind: "arm" }
  | { kind: "event"; time_ns: number }
  | { kind: "hold"; hold: boolean }
  | { kind: "clear" }
  | { kind: "show"; show: Show }
  | { kind: "seen" }
  | { kind: "reference"; keep: boolean }
  // What came for `beside` lies behind the screen, so much later there; null: nothing does.
  | { kind: "beside"; shift_ns: number | null }
  // `apart`: of what came for a file, and of nothing else.
  | { kind: "export"; number: number; format: Format; from_ns: number; to_ns: number; system: string; apart: boolean };

/** Span of a spectrum, and its strongest frequency. */
export interface RowSpectrum {
  count: number;
  held: number;
  rate_hz: number;
  peak: { hz: number; value: number } | null;
}

export interface Row {
  id: string;
  spectrum: RowSpectrum | null;
  measures: Measures | null;
  a: number | null;
  b: number | null;
  newest: number | null;
  reference: boolean;
}

export interface ChannelCounts {
  name: string;
  received: number;
  lost: number;
  skipped: number;
  /** Count by the numbers of the values since the first that came, all inclusive: received, lost, and releases that stored nothing. */
  numbered: number;
  kept: number;
  kept_s: number;
  bytes: number;
}

export interface DrawnTrace {
  kind: "drawn";
  bitmap: ImageBitmap;
  span: Span | null;
  /** Ranges of what is along x and y, by key of the scale. */
  ranges: Record<string, Range>;
  x: Range | null;
  state: SweepState;
  triggers: number;
  hold: boolean;
  /** Present now and then: measuring every picture would cost more than drawing it. */
  rows: Row[] | null;
  counts: ChannelCounts[] | null;
  has_reference: boolean;
  draw_ms: number;
}

export type FromWorker =
  | DrawnTrace
  | { kind: "channels"; channels: StreamChannel[] }
  | { kind: "trouble"; message: string }
  | { kind: "exported"; number: number; blob: Blob | null; message: string };
