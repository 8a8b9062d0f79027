// SPDX-License-Identifier: Apache-2.0
import type { Show, ShownTrace } from "../messages";
import type { Range } from "../signal/ranges";

/** The range of each scale by its key, and that of the x axis where a trace lies along it. */
export interface Scales {
  ranges: Record<string, Range>;
  x: Range | null;
}

/** Traces with one key have one scale. */
export function scaleKey(trace: ShownTrace, show: { scales: Show["scales"] }): string {
  return show.scales === "unit" ? `unit ${trace.unit ?? ""}` : `trace ${trace.id}`;
}
