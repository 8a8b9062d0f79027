// SPDX-License-Identifier: Apache-2.0
// Interrupt sources and their states, from statistics and the configuration; counts are relative to a baseline.
import type { Configuration, SourceStatistics, Statistics } from "../../control/shapes";

export interface SourceShown extends SourceStatistics {
  /** Name of the source, such as `rtp0.fast`. */
  name: string;
  processor: string;
  kind: "timer" | "trigger" | "software";
  priority: number;
  /** Period, ns; null if the source is not a timer. */
  period_ns: number | null;
  /** True if the counts begin at a baseline; the maximum values are then known only to the precision of a bin. */
  counted: boolean;
}

export interface Baseline {
  at_s: number;
  of: Record<string, SourceStatistics>;
}

export function sourcesOf(now: Statistics, configuration: Configuration | null): SourceShown[] {
  const sources = Object.entries(now.sources).map(([name, source]) => {
    const configured = configuration?.sources[name];
    const kind = configured?.kind;
    const period = typeof kind === "object" && kind !== null && "timer" in kind ? (kind.timer as { period_ns: number }).period_ns : null;
    const word = kind && typeof kind === "object" ? Object.keys(kind)[0] : kind;
    return {
      ...source,
      name,
      processor: source.processor ?? configured?.processor ?? name.split(".")[0] ?? "",
      kind: source.kind ?? (word as SourceShown["kind"]) ?? "timer",
      priority: source.priority ?? configured?.priority ?? 0,
      period_ns: source.period_ns ?? period,
      counted: false,
    };
  });
  return sources.sort((a, b) => b.priority - a.priority || a.name.localeCompare(b.name));
}

export function sinceBaseline(source: SourceShown, baseline: Baseline | null): SourceShown {
  const before = baseline?.of[source.name];
  // A source that was lost and has restarted has lower counts than the baseline.
  if (!before || before.firings > source.firings) return source;
  const jitter_bins = less(source.jitter_bins, before.jitter_bins);
  const duration_bins = less(source.duration_bins, before.duration_bins);
  return {
    ...source,
    counted: true,
    firings: source.firings - before.firings,
    overruns: source.overruns - before.overruns,
    late: source.late - before.late,
    faults: source.faults - before.faults,
    jitter_bins,
    duration_bins,
    jitter_median_ns: quantile(jitter_bins, 0.5),
    duration_median_ns: quantile(duration_bins, 0.5),
    jitter_max_ns: quantile(jitter_bins, 1),
    duration_max_ns: quantile(duration_bins, 1),
  };
}

function less(bins: number[], before: number[]): number[] {
  return bins.map((count, bin) => count - (before[bin] ?? 0));
}

/** Returns the upper edge of bin i, ns. */
export function upperEdge(bin: number): number {
  return 2 ** (bin + 1);
}

/** Returns the upper edge, ns, of the first bin at which the cumulative share of the counts reaches `share`; 0 if there are no counts. */
export function quantile(bins: number[], share: number): number {
  const all = bins.reduce((sum, count) => sum + count, 0);
  if (all === 0) return 0;
  let seen = 0;
  for (const [bin, count] of bins.entries()) {
    seen += count;
    if (seen >= Math.ceil(share * all)) return upperEdge(bin);
  }
  return upperEdge(bins.length - 1);
}

/**
 * Returns the fraction of a core that a timer's firings use: the mean duration divided by the period; null if the source is not a timer
 * or has not fired.
 */
export function load(source: SourceShown): number | null {
  if (source.period_ns === null || source.firings === 0) return null;
  return meanDuration(source.duration_bins) / source.period_ns;
}

/** Returns the mean duration, ns, assuming that each count is at the geometric centre of its bin. */
export function meanDuration(bins: number[]): number {
  let sum = 0;
  let all = 0;
  for (const [bin, count] of bins.entries()) {
    sum += count * 2 ** (bin + 0.5);
    all += count;
  }
  return all === 0 ? 0 : sum / all;
}
