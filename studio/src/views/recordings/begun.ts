// SPDX-License-Identifier: Apache-2.0
// The recordings that this tab has started in this run of the system, by the numbers that the system assigns.

import type { RecordingSummary } from "../../control/shapes";
import { tr } from "../../language/text";

export interface RunningRecording {
  recording: number;
  /** Run of the system in which the recording was made. */
  run: string;
  name: string;
  /** State when last read; null before the first reading. */
  summary: RecordingSummary | null;
}

const KEY = "opengpac.recordings";

export function keptRecordings(run: string): RunningRecording[] {
  try {
    const all = JSON.parse(sessionStorage.getItem(KEY) ?? "[]") as RunningRecording[];
    return all.filter((one) => one.run === run);
  } catch {
    return [];
  }
}

export function keepRecordings(all: RunningRecording[]): void {
  sessionStorage.setItem(KEY, JSON.stringify(all));
}

/** Returns a unique name composed of the system and the time: "cell-20261123-154210.mcap". */
export function freshName(system: string, now: Date): string {
  const two = (value: number) => String(value).padStart(2, "0");
  const day = `${now.getFullYear()}${two(now.getMonth() + 1)}${two(now.getDate())}`;
  return `${system.replace(/[^\w.-]+/g, "-")}-${day}-${two(now.getHours())}${two(now.getMinutes())}${two(now.getSeconds())}.mcap`;
}

/**
 * Returns the file name for a name: ".mcap" is appended if missing, because files with other extensions are not listed. Returns "" for
 * an empty name.
 */
export function completedName(name: string): string {
  const said = name.trim();
  return said === "" || said.endsWith(".mcap") ? said : `${said.replace(/\.(mcap)?$/i, "")}.mcap`;
}

/**
 * Returns the recording to which a file belongs; null if it does not belong to a recording of this tab. `isLast` is true for the
 * recording's latest file, which shows the state of the recording.
 */
export function recordingOf(file: string, all: RunningRecording[]): { begun: RunningRecording; isLast: boolean } | null {
  const named = (path: string) => path.slice(path.lastIndexOf("/") + 1);
  for (const begun of all) {
    const files = begun.summary?.files.map(named) ?? [begun.name];
    if (files.includes(file)) return { begun, isLast: files.at(-1) === file };
  }
  return null;
}

/** Splits a text into names of SVVs, which may contain * and ?; returns null if the text selects all SVVs. */
export function namesIn(text: string): string[] | null {
  const names = text.split(/[\s,]+/).filter(Boolean);
  return names.length === 0 ? null : names;
}

/** Formats a size: "12.3 MiB". */
export function sizeText(bytes: number): string {
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  const at = bytes === 0 ? 0 : Math.min(units.length - 1, Math.floor(Math.log2(bytes) / 10));
  return at === 0 ? `${bytes} B` : `${(bytes / 2 ** (10 * at)).toFixed(1)} ${units[at]}`;
}

/** Describes the free disk space: "12.3 GiB free on its disk"; "" if unknown. */
export function freeText(bytes: number | null): string {
  return bytes === null ? "" : tr("recordings.bytesFreeOnItsDisk", { bytes: sizeText(bytes) });
}

/** Returns the sum of the counts. */
export function sumOf(counts: Record<string, number>): number {
  return Object.values(counts).reduce((sum, one) => sum + one, 0);
}
