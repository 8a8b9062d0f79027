// SPDX-License-Identifier: Apache-2.0
// The recordings that this tab has begun in this run of the system: by their numbers, which the system gives.
import type { RecordingSummary } from "../../control/shapes";

export interface RunningRecording {
  recording: number;
  /** Run of the system that it is of. */
  run: string;
  name: string;
  /** State at the last look. */
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

/** A name that no other recording has: the system and when, "cell-20261123-154210.mcap". */
export function freshName(system: string, now: Date): string {
  const two = (value: number) => String(value).padStart(2, "0");
  const day = `${now.getFullYear()}${two(now.getMonth() + 1)}${two(now.getDate())}`;
  return `${system.replace(/[^\w.-]+/g, "-")}-${day}-${two(now.getHours())}${two(now.getMinutes())}${two(now.getSeconds())}.mcap`;
}

/** The file that a name means: recordings end with ".mcap", and one that does not would not be listed. "" where nothing is named. */
export function completedName(name: string): string {
  const said = name.trim();
  return said === "" || said.endsWith(".mcap") ? said : `${said.replace(/\.(mcap)?$/i, "")}.mcap`;
}

/** The recording that a file belongs to; `isLast`: it is its newest file, to which how the recording stands belongs. null: none of this tab's. */
export function recordingOf(file: string, all: RunningRecording[]): { begun: RunningRecording; isLast: boolean } | null {
  const named = (path: string) => path.slice(path.lastIndexOf("/") + 1);
  for (const begun of all) {
    const files = begun.summary?.files.map(named) ?? [begun.name];
    if (files.includes(file)) return { begun, isLast: files.at(-1) === file };
  }
  return null;
}

/** The names of SVVs in a text, with * and ?; null: all. */
export function namesIn(text: string): string[] | null {
  const names = text.split(/[\s,]+/).filter(Boolean);
  return names.length === 0 ? null : names;
}

/** A size for people: "12.3 MiB". */
export function sizeText(bytes: number): string {
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  const at = bytes === 0 ? 0 : Math.min(units.length - 1, Math.floor(Math.log2(bytes) / 10));
  return at === 0 ? `${bytes} B` : `${(bytes / 2 ** (10 * at)).toFixed(1)} ${units[at]}`;
}

/** Returns the free space of its disk: "12.3 GiB free on its disk"; "" where nobody can tell. */
export function freeText(bytes: number | null): string {
  return bytes === null ? "" : `${sizeText(bytes)} free on its disk`;
}

/** Returns the number of messages: all, and those that are not in the file. */
export function sumOf(counts: Record<string, number>): number {
  return Object.values(counts).reduce((sum, one) => sum + one, 0);
}
