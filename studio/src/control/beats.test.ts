// SPDX-License-Identifier: Apache-2.0
import { beforeEach, expect, test, vi } from "vitest";
import { Beats } from "./beats";

beforeEach(() => {
  vi.spyOn(performance, "now").mockReturnValue(0);
});

/** Lead of the daemon's clock over the local one, ms. */
const AHEAD = 5_000_000_000;

test("the daemon's time is that of the quickest beat, and never ahead of the daemon", () => {
  const beats = new Beats();
  expect(beats.daemon_ms(0)).toBeNull();
  for (const [sent, delay] of [
    [0, 80],
    [250, 5],
    [500, 400],
  ] as const) {
    beats.hear(AHEAD + sent, sent + delay);
    const estimate = beats.daemon_ms(1000) ?? 0;
    expect(estimate).toBeLessThanOrEqual(AHEAD + 1000);
  }
  expect(AHEAD + 1000 - (beats.daemon_ms(1000) ?? 0)).toBeLessThan(7);
});

test("beats that were held up make nothing new", () => {
  const beats = new Beats();
  beats.hear(AHEAD + 0, 10);
  beats.hear(AHEAD + 250, 260);
  expect(beats.age_ms(300)).toBeCloseTo(40, 0);
  // The link stalls from 300 to 4300 ms; then the delayed beats arrive one after the other.
  expect(beats.age_ms(4300)).toBeCloseTo(4040, -1);
  beats.hear(AHEAD + 500, 4300);
  expect(beats.age_ms(4300)).toBeGreaterThan(3700);
  beats.hear(AHEAD + 4250, 4301);
  expect(beats.age_ms(4301)).toBeLessThan(60);
});

test("of another run nothing is known", () => {
  const beats = new Beats();
  beats.hear(AHEAD, 10);
  beats.forget();
  expect(beats.daemon_ms(30)).toBeNull();
});
