// SPDX-License-Identifier: Apache-2.0
// 64 SVVs at 1 kHz for ten minutes on the scope: all stored values arrive, and none is lost. Part of `make faults`.
import { join } from "node:path";
import { expect, test } from "vitest";
import { Commander } from "../commander";
import { browse, open, run } from "../running";

const DURATION_S = Number(process.env.OPENGPAC_SCOPE_S ?? 600);
const SAY_S = 30;
const CHANNELS = Array.from({ length: 64 }, (_, i) => `bank.c${String(i).padStart(2, "0")}`);

test(`64 channels at 1 kHz for ${DURATION_S} s`, { timeout: (DURATION_S + 300) * 1000 }, async () => {
  const [running, browser] = await Promise.all([run(join(import.meta.dirname, "../channels.py")), browse(false)]);
  const commander = await Commander.open(running.url);
  const { page, errors } = await open(browser, running.url);
  await page.evaluate((names) => {
    const seen = { count: 0, longest_ms: 0 };
    Object.assign(window, { seen });
    new PerformanceObserver((list) => {
      for (const { duration } of list.getEntries()) {
        seen.count += 1;
        seen.longest_ms = Math.max(seen.longest_ms, duration);
      }
    }).observe({ type: "longtask" });
    window.location.hash = `#/scope?names=${names}`;
  }, CHANNELS.join(","));
  await page.getByText(/^64 channels/).waitFor();
  const counted = async () => {
    const read = async (id: string) => Number(((await page.getByTestId(id).textContent()) ?? "").replaceAll(/\D/g, ""));
    return { received: await read("received"), lost: await read("lost") };
  };
  await commander.start("waves");
  for (let told_s = 0; told_s < DURATION_S; told_s += SAY_S) {
    await page.waitForTimeout(Math.min(SAY_S, DURATION_S - told_s) * 1000);
    const { received, lost } = await counted();
    process.stdout.write(`${Math.min(told_s + SAY_S, DURATION_S)} s: received ${received}, lost ${lost}\n`);
  }
  await commander.halt("waves");
  const stored = CHANNELS.length * (await commander.value("bank.c63"));
  const over = Date.now() + 60_000;
  let { received, lost } = await counted();
  while (received + lost < stored && Date.now() < over) {
    await page.waitForTimeout(200);
    ({ received, lost } = await counted());
  }
  const long = await page.evaluate(() => (window as unknown as { seen: { count: number; longest_ms: number } }).seen);
  process.stdout.write(`stored ${stored}, received ${received}, lost ${lost}; `);
  process.stdout.write(`${long.count} tasks of the page over 50 ms, the longest ${Math.round(long.longest_ms)} ms\n`);
  await commander.close();
  await browser.close();
  await running.stop();
  expect({ received, lost }).toEqual({ received: stored, lost: 0 });
  expect(errors).toEqual([]);
});
