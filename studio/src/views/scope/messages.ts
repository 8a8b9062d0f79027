// SPDX-License-Identifier: Apache-2.0
// Messages between the page and the scope's worker.

import type { RecordedSums as Sums } from "../../control/shapes";
import type { Texts } from "../../language/text";
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

/** A trace of one component, as drawn. */
export interface ShownTrace {
  id: string;
  setup: TraceSetup;
  colour: string;
  pattern: number[];
  unit: string | null;
}

/** Time window shown on the screen; null if it follows the sweep. */
export type Window = { from_ns: number; to_ns: number; origin_ns: number; triggered: boolean } | null;

/** Vertical position of a plot in the picture. */
export interface Band {
  plot: number;
  top: number;
  height: number;
}

export interface Show {
  /** Width and height of the plots in device pixels, and device pixels per CSS pixel. Nothing is drawn if the width is 0. */
  width: number;
  height: number;
  ratio: number;
  window: Window;
  traces: ShownTrace[];
  scales: ScaleMode;
  steps: boolean;
  xy: string | null;
  /** Settings of spectra if the x axis is frequency; null for time. */
  spectrum: SpectrumSetup | null;
  /** True for a recording, whose spectra are computed from all values of the span, which are loaded separately. */
  recorded: boolean;
  /** Positions of the plots in the picture, from the top. */
  plots: Band[];
  /** Times of the cursors relative to the origin of the axis, s. */
  cursors: [number, number] | null;
  ink: { text: string; quiet: string; bad: string; warn: string; ground: string };
  font: string;
  marker: { channel: string; component: string; level: number } | null;
}

/** Destination of a recording's values: the screen, the traces shown behind, the spectra of either, or a file. */
export type Into = "shown" | "beside" | "whole" | "wholeBeside" | "file";
export type Format = "csv" | "mcap" | "svg";

export type ToWorker =
  /** Texts of the page's language. */
  | { kind: "texts"; texts: Texts; language: string }
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
  // Values for `beside` are shown behind the traces, and occur `shift_ns` later; null hides them.
  | { kind: "beside"; shift_ns: number | null }
  // `apart` exports only the values fetched for a file.
  | { kind: "export"; number: number; format: Format; from_ns: number; to_ns: number; system: string; apart: boolean };

/** Properties of a spectrum, and its strongest frequency. */
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
  /**
   * Number of values since the first, according to their numbers: received values, lost values, and releases at which no value was
   * stored.
   */
  numbered: number;
  kept: number;
  kept_s: number;
  bytes: number;
}

export interface DrawnTrace {
  kind: "drawn";
  bitmap: ImageBitmap;
  span: Span | null;
  /** Ranges of the axes by key of the scale. */
  ranges: Record<string, Range>;
  x: Range | null;
  state: SweepState;
  triggers: number;
  hold: boolean;
  /** Measurements. Not included in every picture, because they would cost more than drawing it. */
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
