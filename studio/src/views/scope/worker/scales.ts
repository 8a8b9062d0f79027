// SPDX-License-Identifier: Apache-2.0
import type { Show, ShownTrace } from "../messages";
import type { Range } from "../signal/ranges";

/** Ranges of the scales by key, and the range of the x axis if it shows the values of a trace. */
export interface Scales {
  ranges: Record<string, Range>;
  x: Range | null;
}

/** Returns the key of a scale that belongs to one trace. */
export function ownKey(id: string): string {
  return `trace ${id}`;
}

/** Returns the key of a trace's scale; within a plot, traces with the same unit share a scale. */
export function scaleKey(trace: Pick<ShownTrace, "id" | "unit" | "setup">, show: { scales: Show["scales"] }): string {
  if (show.scales !== "unit") return ownKey(trace.id);
  const { plot = 0 } = trace.setup;
  return plot === 0 ? `unit ${trace.unit ?? ""}` : `plot ${plot} unit ${trace.unit ?? ""}`;
}
