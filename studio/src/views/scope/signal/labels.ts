// SPDX-License-Identifier: Apache-2.0
// Labels of an axis: with as many digits as the distance between its marks requires.

/** Labels of the tick marks of an axis, and the conversion from labels to values. */
export interface Labels {
  texts: string[];
  /** Common factor and offset, usually "": "×10⁶", "+ 1.25", "×10⁻⁹ + 3". Each value is label · factor + offset. */
  common: string;
  factor: number;
  offset: number;
}

/** Magnitudes above and below which numbers are written with a power of ten. */
const [LARGE, SMALL] = [1e6, 1e-3];
const DECIMALS_MAX = 20;

/**
 * Returns labels for ascending tick marks that are multiples of `step`, usually at most `room` characters long. If double precision
 * cannot distinguish marks, their repeated labels are empty.
 */
export function labelsOf(marks: readonly number[], step: number, room: number): Labels {
  const fits = ({ texts }: Labels) => texts.every((text) => text.length <= room);
  const [plain, short] = [scaled(marks, step, 0, SMALL), scaled(marks, step, 0, 1)];
  if (fits(plain)) return plain;
  if (fits(short)) return short;
  const [first, last] = [marks[0] as number, marks.at(-1) as number];
  const unit = 10 ** Math.ceil(Math.log10(Math.max(last - first, step)) + 1e-9);
  const offset = Math.floor(first / unit) * unit;
  if (offset === 0 || !Number.isFinite(offset)) return short;
  const rest = marks.map((mark) => Math.round((mark - offset) / step) * step);
  const [away, awayShort] = [scaled(rest, step, offset, SMALL), scaled(rest, step, offset, 1)];
  return fits(away) ? away : awayShort;
}

/** Formats the ends of a range with enough digits to distinguish them: "1234.56 … 1234.58". */
export function rangeText(lo: number, hi: number): string {
  const size = hi - lo;
  if (!(size > 0) || !Number.isFinite(size)) return `${Number(lo.toPrecision(4))} … ${Number(hi.toPrecision(4))}`;
  const largest = Math.max(Math.abs(lo), Math.abs(hi));
  const digits = Math.min(17, Math.max(4, Math.ceil(Math.log10(largest / size)) + 3));
  return `${Number(lo.toPrecision(digits))} … ${Number(hi.toPrecision(digits))}`;
}

/** Formats the tick marks. If they are below the magnitude `small`, all labels share a power of ten. */
function scaled(marks: readonly number[], step: number, offset: number, small: number): Labels {
  const size = Math.max(step, ...marks.map(Math.abs));
  const exponent = size >= LARGE || size < small ? 3 * Math.floor(Math.log10(size * (1 + 1e-12)) / 3) : 0;
  const factor = 10 ** exponent;
  const decimals = decimalsOf(step / factor);
  const texts = marks.map((mark) => {
    const text = (mark / factor).toFixed(decimals);
    return Number(text) === 0 ? text.replace("-", "") : text;
  });
  const parts = [
    exponent === 0 ? "" : `×10${raised(exponent)}`,
    offset === 0 ? "" : `${offset < 0 ? "−" : "+"} ${digitsOf(Math.abs(offset), step)}`,
  ];
  return {
    texts: texts.map((text, i) => (texts.indexOf(text) === i ? text : "")),
    common: parts.filter(Boolean).join(" "),
    factor,
    offset,
  };
}

/** Returns the number of decimal places of a step: 0.25 has two. */
function decimalsOf(step: number): number {
  for (let decimals = 0; decimals < DECIMALS_MAX; decimals += 1) {
    const whole = step * 10 ** decimals;
    if (whole >= 0.5 && Math.abs(whole - Math.round(whole)) < 1e-6 * whole) return decimals;
  }
  return DECIMALS_MAX;
}

/** Formats a number to the precision of a step. */
function digitsOf(value: number, step: number): string {
  const digits = Math.min(17, Math.max(1, Math.ceil(Math.log10(value / step)) + 1));
  return String(Number(value.toPrecision(digits)));
}

function raised(exponent: number): string {
  return [...String(exponent)].map((digit) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(digit)]).join("");
}
