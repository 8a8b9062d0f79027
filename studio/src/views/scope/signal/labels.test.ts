// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { randomOf } from "../../../../tests/randomActions";
import { labelsOf, rangeText } from "./labels";
import { stepOf, ticks } from "./ticks";

test("labels have the digits that their distance needs", () => {
  expect(labelsOf([0, 0.25, 0.5], 0.25, 7).texts).toEqual(["0.00", "0.25", "0.50"]);
  expect(labelsOf([-2, 0, 2], 2, 7)).toMatchObject({ texts: ["-2", "0", "2"], common: "" });
  expect(labelsOf([0, 2e6, 4e6], 2e6, 7)).toMatchObject({ texts: ["0", "2", "4"], common: "×10⁶" });
  expect(labelsOf([1e-5, 2e-5], 1e-5, 7)).toMatchObject({ texts: ["10", "20"], common: "×10⁻⁶" });
  expect(labelsOf([1234.5678, 1234.568, 1234.5682], 0.0002, 7)).toMatchObject({
    texts: ["0.0008", "0.0010", "0.0012"],
    common: "+ 1234.567",
  });
  expect(labelsOf([1234.5678, 1234.568, 1234.5682], 0.0002, 5)).toMatchObject({ texts: ["0.8", "1.0", "1.2"], common: "×10⁻³ + 1234.567" });
  expect(labelsOf([-0.0015, -0.001], 0.0005, 6)).toMatchObject({ texts: ["-1.5", "-1.0"], common: "×10⁻³" });
  expect(labelsOf([], 1, 7).texts).toEqual([]);
});

test("no two labels of an axis are equal, and each is its mark, at any zoom and offset", () => {
  const next = randomOf(31);
  for (let time = 0; time < 20_000; time += 1) {
    const size = 10 ** (-12 + 24 * next());
    // Limits the offset so that doubles still resolve the range into 10,000 steps.
    const offset = (next() < 0.2 ? 0 : size * 10 ** (11 * next())) * (next() < 0.5 ? -1 : 1);
    const [lo, hi] = [offset - size * next(), offset + size * next()];
    const count = 2 + Math.floor(8 * next());
    const marks = ticks(lo, hi, count);
    const { texts, factor, offset: away, common } = labelsOf(marks, stepOf(lo, hi, count), 7);
    const about = `${lo} to ${hi} by ${count}: ${texts.join(" | ")} ${common}`;
    expect(new Set(texts).size, about).toBe(marks.length);
    expect(
      texts.every((text) => text !== "" && text.length <= 8),
      about,
    ).toBe(true);
    const step = stepOf(lo, hi, count);
    for (const [i, text] of texts.entries())
      expect(Math.abs(Number(text) * factor + away - (marks[i] as number)), about).toBeLessThan(step / 50);
    expect(new Set(rangeText(lo, hi).split(" … ")).size, about).toBe(2);
  }
});
