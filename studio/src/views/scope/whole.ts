// SPDX-License-Identifier: Apache-2.0

import type { Past } from "../../control/source";
import { tr } from "../../language/text";
import { runsOf } from "./recorded";
import type { Run, StreamChannel } from "./signal/frame";

/** Number of columns per request. No value is left out if each column has at most two values. */
const COLUMNS = 10_000;
/** Maximum number of values of one channel in a file. */
export const VALUES_MAX = 5_000_000;

/**
 * Yields every value of some channels between two times, inclusive and in order, for files. A section with more values than its columns
 * can hold is requested again in smaller sections. Throws `RefusalError`, or an `Error` if there are more than `VALUES_MAX` values.
 */
export async function* wholeOf(
  past: Pick<Past, "span">,
  channels: readonly StreamChannel[],
  from_ns: number,
  to_ns: number,
  signal: AbortSignal,
): AsyncIterable<Run[]> {
  const runs: Run[] = [];
  let most = 0;
  let isWhole = true;
  const counted = channels.map(() => ({ came: 0, stored: 0 }));
  const names = channels.map((channel) => channel.name);
  for await (const part of past.span(names, from_ns, to_ns, COLUMNS, signal)) {
    const came = runsOf(part, channels).map((run) => between(run, channels[run.channel]?.components ?? 1, from_ns, to_ns));
    runs.push(...came);
    part.channels.forEach(({ sums }, at) => {
      const count = counted[at];
      if (!count) return;
      count.came += came[at]?.times_ns.length ?? 0;
      count.stored += Math.max(0, ...sums.map((sum) => sum.count));
    });
  }
  for (const { came, stored } of counted) {
    most = Math.max(most, stored);
    if (came < stored) isWhole = false;
  }
  if (most > VALUES_MAX) throw new Error(tr("scope.aChannelHasMostValuesBut", { most, VALUES_MAX }));
  if (isWhole || to_ns <= from_ns) return yield runs;
  const parts = Math.max(2, Math.ceil(most / (COLUMNS / 2)));
  const size = Math.max(1, Math.ceil((to_ns - from_ns + 1) / parts));
  for (let begin = from_ns; begin <= to_ns; begin += size) {
    yield* wholeOf(past, channels, begin, Math.min(to_ns, begin + size - 1), signal);
  }
}

/** Returns the values between two times, without the previous value that the system adds. */
function between(run: Run, components: number, from_ns: number, to_ns: number): Run {
  let [from, to] = [0, run.times_ns.length];
  while (from < to && (run.times_ns[from] as number) < from_ns) from += 1;
  while (to > from && (run.times_ns[to - 1] as number) > to_ns) to -= 1;
  return {
    ...run,
    times_ns: run.times_ns.slice(from, to),
    numbers: run.numbers.slice(from, to),
    values: run.values.slice(from * components, to * components),
  };
}
