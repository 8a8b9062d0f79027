// SPDX-License-Identifier: Apache-2.0
// Readable numbers: only significant digits, with units from the system.
import type { Value } from "../control/shapes";

/** Formats a duration in a suitable unit: "850 ns", "12.4 µs", "1.00 ms", "2.50 s". */
export function duration(ns: number | null | undefined): string {
  if (ns === null || ns === undefined || !Number.isFinite(ns)) return "–";
  const size = Math.abs(ns);
  if (size < 1e3) return `${Math.round(ns)} ns`;
  if (size < 1e6) return `${three(ns / 1e3)} µs`;
  if (size < 1e9) return `${three(ns / 1e6)} ms`;
  return `${three(ns / 1e9)} s`;
}

function three(value: number): string {
  const size = Math.abs(value);
  return value.toFixed(size < 10 ? 2 : size < 100 ? 1 : 0);
}

/** Formats a period exactly: "1 ms", "20 ms", "0.5 ms". */
export function period(ns: number): string {
  if (ns >= 1e9) return `${ns / 1e9} s`;
  if (ns >= 1e6) return `${ns / 1e6} ms`;
  if (ns >= 1e3) return `${ns / 1e3} µs`;
  return `${ns} ns`;
}

/** Formats a count with thin spaces between thousands. */
export function count(value: number): string {
  return Math.trunc(value)
    .toString()
    .replace(/\B(?=(\d{3})+(?!\d))/g, "\u2009");
}

export function percent(part: number): string {
  if (!Number.isFinite(part)) return "–";
  return `${(part * 100).toFixed(part < 0.1 ? 1 : 0)} %`;
}

/** Formats a time on the system's clock in seconds, with a resolution of 1 ms: "12.345 s". */
export function seconds(time_s: number): string {
  return `${time_s.toFixed(3)} s`;
}

/** Minimum for a wall-clock time, ns since 1970. Under the virtual clock, wall-clock times are those of the system, which begin at 0. */
const WALL_MIN_NS = 1e17;

/** Formats ns since 1970 as a time of day: "14:03:22". Returns an empty string under the virtual clock. */
export function clockText(wall_ns: number): string {
  return wall_ns < WALL_MIN_NS ? "" : new Date(wall_ns / 1e6).toLocaleTimeString("en-GB");
}

/** Formats ns since 1970 as a date and time of day: "2026-11-29 14:03:22". */
export function dayText(wall_ns: number): string {
  return wall_ns < WALL_MIN_NS ? "" : `${new Date(wall_ns / 1e6).toLocaleDateString("sv-SE")} ${clockText(wall_ns)}`;
}

/** Formats a live number with a roughly constant width, so that the digits do not jump. */
export function figure(value: number): string {
  if (!Number.isFinite(value)) return String(value);
  if (Number.isInteger(value) && Math.abs(value) < 1e9) return value.toString();
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(3);
  return value.toFixed(size >= 1e3 ? 1 : size >= 100 ? 2 : 4);
}

/** Formats a number for a readout: integers exactly, others with seven digits. */
export function reading(value: number): string {
  if (!Number.isFinite(value) || (Number.isInteger(value) && Math.abs(value) < 1e15)) return String(value);
  const size = Math.abs(value);
  return size >= 1e7 || size < 1e-4 ? value.toExponential(6) : value.toPrecision(7);
}

/**
 * Formats any value: arrays in brackets, structs with their members. Set `float` if the type is known to be a floating-point type, so
 * that its values keep their decimals.
 */
export function valueText(value: Value | undefined, float = false): string {
  if (value === undefined || value === null) return "–";
  if (typeof value === "number") return float ? floatFigure(value) : figure(value);
  if (typeof value === "boolean") return value ? "true" : "false";
  if (typeof value === "string") return value;
  if (Array.isArray(value)) return `[${value.map((one) => valueText(one, float)).join(", ")}]`;
  return `{${Object.entries(value)
    .map(([name, member]) => `${name} ${valueText(member, float)}`)
    .join(", ")}}`;
}

// Smaller values than any unit resolves are rounding errors, and would only flicker.
const NOTHING = 1e-9;

function floatFigure(value: number): string {
  if (Math.abs(value) < NOTHING) return "0.0000";
  return Number.isInteger(value) && Math.abs(value) < 1e6 ? value.toFixed(Math.abs(value) >= 100 ? 2 : 4) : figure(value);
}

export function isFloat(type_text: string | undefined): boolean {
  return type_text !== undefined && /double|float/.test(type_text);
}

/** Appends the unit to a value. */
export function withUnit(text: string, unit: string | null | undefined): string {
  return unit ? `${text}\u202f${unit}` : text;
}
