// SPDX-License-Identifier: Apache-2.0
// The longest task of the page while 200 blocks are viewed. For a quiet machine; part of `make faults`.
import { join } from "node:path";
import { expect, test } from "vitest";
import { choose, edit, move, openFlow, pan, valuesChange, zoom } from "../large";
import { browse, open, run } from "../running";

const LONGEST_MS = 200;
const ROUNDS = 10;

test(`200 blocks with live values: no task of the page takes ${LONGEST_MS} ms`, { timeout: 300_000 }, async () => {
  const [running, browser] = await Promise.all([run(join(import.meta.dirname, "../blocks.py"), "--edit"), browse(false)]);
  const { page, errors } = await open(browser, running.url);
  let doing = "";
  const longest: Record<string, number> = {};
  await page.exposeFunction("busy", (duration: number) => {
    longest[doing] = Math.max(longest[doing] ?? 0, duration);
  });
  await page.evaluate(() => {
    const told = (window as unknown as { busy: (duration: number) => void }).busy;
    new PerformanceObserver((list) => {
      for (const { duration } of list.getEntries()) told(duration);
    }).observe({ type: "longtask" });
  });
  const timed = async (what: string, act: () => Promise<void>) => {
    doing = what;
    await act();
    process.stdout.write(`${what}: the longest task ${longest[what] ? `${Math.round(longest[what])} ms` : "is under 50 ms"}\n`);
  };
  await timed("open", () => openFlow(page));
  await timed("look on", async () => {
    for (let round = 0; round < ROUNDS; round += 1) await valuesChange(page);
  });
  await timed("zoom", () => zoom(page));
  await timed("pan", () => pan(page));
  await timed("choose", () => choose(page, "gain07_4"));
  await timed("edit", () => edit(page));
  await timed("move", () => move(page, "gain07_4"));
  await browser.close();
  await running.stop();
  expect(errors).toEqual([]);
  expect(Math.max(0, ...Object.values(longest))).toBeLessThan(LONGEST_MS);
});
