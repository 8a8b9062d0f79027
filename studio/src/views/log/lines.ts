// SPDX-License-Identifier: Apache-2.0
// The log as lines: entries and end reports in the order of their times, with repeated ones merged, filtered, and exported.

import { countUntil } from "../../control/recorded/state";
import type { End, LogEntry, Report } from "../../control/shapes";
import type { KeptEntries } from "../../control/topics";

export interface Line {
  /** Key of the line: `e12` for an entry, `r3` for a report. */
  key: string;
  time_s: number;
  kind: string;
  about: string;
  text: string;
  who: string;
  /** Number of consecutive repetitions, and the time of the first one. */
  times: number;
  first_s: number;
  report: Report | null;
  /** True if the line is from an earlier run, before the system restarted. */
  isEarlier: boolean;
}

/** Kinds that indicate a fault. */
export const BAD_KINDS = new Set(["fault", "processor_lost", "emergency_stop", "lost"]);
export const WARN_KINDS = new Set(["overrun", "late", "force"]);

export function linesOf(log: KeptEntries<LogEntry> | null, ends: KeptEntries<End> | null): Line[] {
  const earlier = merged((log?.earlier ?? []).map(entryLine), (ends?.earlier ?? []).map(reportLine));
  const present = merged(allOf(log).map(entryLine), allOf(ends).map(reportLine));
  return [...earlier.map((line, index) => ({ ...line, key: `b${index}`, isEarlier: true })), ...present];
}

/** Returns all entries; in a recording, including those after the cursor. */
function allOf<T>(kept: KeptEntries<T> | null): T[] {
  return [...(kept?.entries ?? []), ...(kept?.later ?? [])];
}

/** Returns the number of lines, sorted by time, that are not later than a time. */
export function linesUntil(lines: readonly Line[], time_ns: number): number {
  return countUntil(lines, (line) => line.time_s, time_ns);
}

function entryLine(entry: LogEntry): Line {
  return {
    key: `e${entry.sequence}`,
    time_s: entry.time_s,
    kind: entry.kind,
    about: entry.about,
    text: entry.text,
    who: entry.who ?? "",
    times: 1,
    first_s: entry.time_s,
    report: null,
    isEarlier: false,
  };
}

function reportLine({ number, report }: End): Line {
  return {
    key: `r${number}`,
    time_s: report.time_s,
    kind: "report",
    about: report.instance,
    text: [report.condition, report.message].filter(Boolean).join(": "),
    who: "",
    times: 1,
    first_s: report.time_s,
    report,
    isEarlier: false,
  };
}

/** Merges two lists, each sorted by time. */
function merged(entries: Line[], reports: Line[]): Line[] {
  const lines: Line[] = [];
  let next = 0;
  for (const entry of entries) {
    for (let report = reports[next]; report && report.time_s < entry.time_s; report = reports[++next]) lines.push(report);
    lines.push(entry);
  }
  return lines.concat(reports.slice(next));
}

export interface Filter {
  /** Kinds that are hidden. */
  hidden: ReadonlySet<string>;
  /** Words that must all occur in the line. */
  text: string;
}

/** Verbs that are started each time a button is pressed. */
const CHATTER = new Set(["jog", "jog_linear"]);
/** Maximum number of kinds of lines that a press of such a button may cause. */
const CHATTER_KINDS = 16;

/** Returns the verb of the instance to which a line refers: `jog` for `jog#7`. */
function verbOf(line: Line): string {
  return line.about.replace(/#\d+$/, "");
}

/**
 * Returns the index of the line that `line` repeats, or -1. Usually this is the previous line. Each press of a jog button causes several
 * lines, so a line of a jog repeats the last line of the same kind, unless something else has happened since.
 */
function repeated(shown: readonly Line[], line: Line): number {
  const isChatter = CHATTER.has(verbOf(line)) && !BAD_KINDS.has(line.kind) && !WARN_KINDS.has(line.kind);
  if (line.report && !isChatter) return -1;
  for (let at = shown.length - 1; at >= 0 && at >= shown.length - (isChatter ? CHATTER_KINDS : 1); at--) {
    const before = shown[at];
    if (!before || before.isEarlier !== line.isEarlier || (isChatter && verbOf(before) !== verbOf(line))) return -1;
    const isSame = isChatter || before.about === line.about;
    if (isSame && before.kind === line.kind && before.text === line.text && before.who === line.who) return at;
  }
  return -1;
}

/** Returns the lines that pass the filter. A repetition of an earlier line only increments its count. */
export function shownLines(lines: Line[], filter: Filter): Line[] {
  const words = filter.text.toLowerCase().split(/\s+/).filter(Boolean);
  const shown: Line[] = [];
  for (const line of lines) {
    if (filter.hidden.has(line.kind)) continue;
    if (words.length > 0) {
      const all = `${line.kind} ${line.about} ${line.text} ${line.who}`.toLowerCase();
      if (!words.every((word) => all.includes(word))) continue;
    }
    const at = repeated(shown, line);
    const [before] = at < 0 ? [] : shown.splice(at, 1);
    shown.push(before ? { ...line, key: before.key, times: before.times + 1, first_s: before.first_s } : line);
  }
  return shown;
}

/** Returns the number of lines of each kind, in the order of first occurrence. */
export function kindsOf(lines: Line[]): Map<string, number> {
  const kinds = new Map<string, number>();
  for (const line of lines) kinds.set(line.kind, (kinds.get(line.kind) ?? 0) + 1);
  return kinds;
}

/** Formats the lines as JSON, one object per line, with complete reports. */
export function asJsonLines(lines: Line[]): string {
  return lines
    .map(({ time_s, kind, about, text, who, times, first_s, report, isEarlier }) =>
      JSON.stringify({
        time_s,
        kind,
        about,
        text,
        ...(who && { who }),
        ...(times > 1 && { times, first_s }),
        ...(report && { report }),
        ...(isEarlier && { run: "earlier" }),
      }),
    )
    .join("\n")
    .concat("\n");
}

export function asCsv(lines: Line[]): string {
  const rows = lines.map((line) =>
    [line.time_s, line.kind, line.about, line.text, line.who, line.times, line.isEarlier ? "earlier" : "present"].map(csvField).join(","),
  );
  return ["time_s,kind,about,text,who,times,run", ...rows].join("\r\n").concat("\r\n");
}

function csvField(value: string | number): string {
  const text = String(value);
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}
