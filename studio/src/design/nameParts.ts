// SPDX-License-Identifier: Apache-2.0

/** Returns the parts of a name from a program; it wraps only between them, after `_`, `.` and `/`. */
export function nameParts(name: string): string[] {
  return name.split(/(?<=[_./])/);
}
