// SPDX-License-Identifier: Apache-2.0
import type { Show, ShownTrace } from "../messages";
import type { Range } from "../signal/ranges";

/** The range of each scale by its key, and that of the x axis where a trace lies along it. */
export interface Scales {
  ranges: Record<string, Range>;
  x: Range | null;
}

/** Traces with one key have one scale: those of one unit, in each plot. */
export function scaleKey(trace: Pick<ShownTrace, "id" | "unit" | "setup">, show: { scales: Show["scales"] }): string {
  if (show.scales !== "unit") return `trace ${trace.id}`;
  const { plot = 0 } = trace.setup;
  return plot === 0 ? `unit ${trace.unit ?? ""}` : `plot ${plot} unit ${trace.unit ?? ""}`;
}
