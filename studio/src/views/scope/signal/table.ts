// SPDX-License-Identifier: Apache-2.0
// Export of the stored values of whole channels between two times.
import { tr } from "../../../language/text";
import type { Ring } from "./ring";
import { missingIn } from "./series";

/** A channel to be exported, with its selected components. */
export interface ExportedChannel {
  name: string;
  type_text: string;
  unit: string | null;
  ring: Ring;
  components: { name: string; index: number }[];
  /** Names of all components. */
  all: string[];
}

/**
 * Callback for rows. A row consists of a time and, for each channel, the index in its ring of the value at that time, or null if there
 * is none.
 */
export type Row = (time_ns: number, indices: (number | null)[]) => void;

/** Iterates over the values of all channels in time order. Values of several channels at the same time form one row. */
export function rows(channels: readonly ExportedChannel[], from_ns: number, to_ns: number, row: Row): void {
  const next = channels.map(({ ring }) => ring.indexAt(from_ns));
  const indices: (number | null)[] = channels.map(() => null);
  for (;;) {
    let time_ns = Number.POSITIVE_INFINITY;
    for (let i = 0; i < channels.length; i += 1) {
      const ring = (channels[i] as ExportedChannel).ring;
      const at = next[i] as number;
      if (at < ring.end) time_ns = Math.min(time_ns, ring.time_ns(at));
    }
    if (time_ns > to_ns || time_ns === Number.POSITIVE_INFINITY) return;
    for (let i = 0; i < channels.length; i += 1) {
      const ring = (channels[i] as ExportedChannel).ring;
      const at = next[i] as number;
      const has = at < ring.end && ring.time_ns(at) === time_ns;
      indices[i] = has ? at : null;
      if (has) next[i] = at + 1;
    }
    row(time_ns, indices);
  }
}

/** Describes the missing values between two times, one line per gap. */
export function missingText(channels: readonly ExportedChannel[], from_ns: number, to_ns: number): string[] {
  return channels.flatMap(({ name, ring }) =>
    missingIn(ring, from_ns, to_ns).map(({ from_ns: start, to_ns: stop, lost, skipped }) => {
      const until = Number.isFinite(stop) ? ` ${tr("scope.andBeforeStopS", { stop: secondsText(stop) })}` : "";
      const what = [
        lost > 0 ? tr("scope.lostLost", { lost }) : "",
        skipped > 0 ? tr("scope.skippedDiscardedScopeStopped", { skipped }) : "",
      ]
        .filter(Boolean)
        .join(", ");
      return tr("scope.nameWhatBehindStartSuntil", { name, what, start: secondsText(start), until });
    }),
  );
}

/** Formats a time in seconds, exact to the nanosecond. */
export function secondsText(time_ns: number): string {
  const sign = time_ns < 0 ? "-" : "";
  const size = Math.abs(time_ns);
  const whole = Math.floor(size / 1e9);
  return `${sign}${whole}.${String(size - whole * 1e9).padStart(9, "0")}`;
}
