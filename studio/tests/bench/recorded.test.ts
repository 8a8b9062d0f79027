// SPDX-License-Identifier: Apache-2.0
// A recording of ten minutes with 64 channels at 1 kHz: the time to open it, and the time until the views show a new cursor position.
// Printed next to the bars of the design, 3 s and 50 ms at the 95th percentile. OPENGPAC_RECORDED_S sets a shorter duration;
// OPENGPAC_RECORDED names the folder of an existing recording, long.mcap.
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { freePort, serve, tokenIn } from "../daemon";
import { browse, goTo, open, PYTHON, SURROUNDINGS } from "../running";

const LENGTH_S = Number(process.env.OPENGPAC_RECORDED_S ?? 600);
const SCRUBS = 200;

/** Moves the slider to random places; returns how long each took until the page was painted for that time, ms. */
async function scrub(page: Page, times: number): Promise<number[]> {
  return await page.evaluate(async (count) => {
    const slider = document.querySelector<HTMLInputElement>('.time-bar input[type="range"]');
    const bar = document.querySelector<HTMLElement>(".time-bar");
    if (!slider || !bar) throw new Error("there is no slider");
    const put = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value")?.set;
    let seed = 7;
    const took: number[] = [];
    for (let scrubbed = 0; scrubbed < count; scrubbed += 1) {
      seed = (seed * 48271) % 2147483647;
      const begun = performance.now();
      put?.call(slider, String(seed % Number(slider.max)));
      slider.dispatchEvent(new Event("input", { bubbles: true }));
      for (;;) {
        await new Promise((painted) => requestAnimationFrame(painted));
        if (bar.dataset.shown === bar.dataset.cursor) break;
      }
      took.push(performance.now() - begun);
    }
    return took.sort((one, other) => one - other);
  }, times);
}

const at = (sorted: number[], part: number) =>
  (sorted[Math.min(sorted.length - 1, Math.floor(part * sorted.length))] ?? Number.NaN).toFixed(1);

test(`a recording of ${LENGTH_S} s with 64 channels at 1 kHz`, { timeout: (3 * LENGTH_S + 600) * 1000 }, async () => {
  const given = process.env.OPENGPAC_RECORDED;
  const folder = given ?? mkdtempSync(join(tmpdir(), "studio-bench-"));
  if (!given) execFileSync(PYTHON, [join(import.meta.dirname, "ten_minutes.py"), folder, String(LENGTH_S)], { env: SURROUNDINGS });
  const [token, port] = [tokenIn(folder, `page${Date.now()}`), await freePort()];
  const [daemon, browser] = await Promise.all([serve(folder, port), browse(false)]);
  const say = (text: string) => process.stdout.write(`${text}\n`);
  try {
    const { page, errors } = await open(browser, `http://127.0.0.1:${port}/#token=${token}`);
    await goTo(page, "Recordings");
    const row = page.locator("tr").filter({ has: page.getByRole("rowheader", { name: "long.mcap" }) });
    await row.getByText("complete", { exact: true }).waitFor();
    const begun = performance.now();
    await row.getByRole("button", { name: "Open" }).click();
    await page.locator(".time-bar.recorded").waitFor();
    await expect.poll(() => page.locator(".time-bar").evaluate((bar) => bar.dataset.shown === bar.dataset.cursor)).toBe(true);
    say(`opens in ${((performance.now() - begun) / 1000).toFixed(2)} s (3 s at most)`);
    for (const view of ["System", "Data flow", "Verbs", "Devices", "Log"]) {
      await goTo(page, view);
      await scrub(page, 5);
      const took = await scrub(page, SCRUBS);
      say(`scrub, ${view}: median ${at(took, 0.5)} ms, 95 % ${at(took, 0.95)} ms (50 ms at most), longest ${at(took, 1)} ms`);
    }
    const drawn = performance.now();
    await page.evaluate(() => {
      window.location.hash = "#/scope?names=signal.c00";
    });
    const shown = page.getByTestId("values");
    await shown.waitFor();
    const values = async () => Number(((await shown.textContent()) ?? "").replace(/\D/g, ""));
    await expect.poll(values, { timeout: 300_000 }).toBeGreaterThan(1000 * (LENGTH_S - 1));
    say(`the scope has all of one channel in ${((performance.now() - drawn) / 1000).toFixed(2)} s, and a picture before`);
    const took = await scrub(page, SCRUBS);
    say(`scrub, Scope: median ${at(took, 0.5)} ms, 95 % ${at(took, 0.95)} ms (50 ms at most), longest ${at(took, 1)} ms`);
    expect(errors).toEqual([]);
  } finally {
    await browser.close();
    daemon.removeAllListeners("exit");
    daemon.kill("SIGKILL");
    if (!given) rmSync(folder, { recursive: true, force: true });
  }
});
