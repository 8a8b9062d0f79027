// SPDX-License-Identifier: Apache-2.0
// A system with a virtual clock, advanced from the page: by a firing, until a condition, at a rate.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import {
  axeFindings,
  browse,
  command,
  goTo,
  LOOKS,
  type Opened,
  open,
  type Running,
  run,
  STOP,
  shoot,
  standsStill,
  stopRectangles,
} from "./running";

let running: Running;
let browser: Browser;
let studio: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "virtual.py")), browse(false)]);
  studio = await open(browser, running.url);
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
});

/** Returns the system time at the top of the page, s. */
async function now(page: Page): Promise<number> {
  return Number.parseFloat((await page.locator(".bar .clock .figures").textContent()) ?? "");
}

test("the clock stands until it is moved: a firing, and to the condition that is named", async () => {
  const { page } = studio;
  const clock = page.getByRole("group", { name: "Virtual clock" });
  await expect.poll(() => now(page)).toBeLessThan(0.05);
  const before = await now(page);
  const next = clock.getByRole("button", { name: "Next firing" });
  await standsStill(next);
  await next.click();
  await expect.poll(() => now(page)).toBeGreaterThan(before);
  expect((await now(page)) - before).toBeLessThan(0.0205);
  await clock.getByLabel("Condition").fill("fell");
  await command(clock.getByRole("button", { name: "Run to condition" }), clock.getByRole("status").getByText("blink#1"));
  expect(await clock.getByRole("status").textContent()).toContain("fell");
  await expect.poll(() => now(page)).toBeCloseTo(2.02, 3);
  // The log has no later entry: the clock stands at that very firing.
  await goTo(page, "Log");
  await page.locator(".line").last().getByText("command list 'low' after 'high'").waitFor();
});

test("what rests on something is carried by a force that is drawn, beside the meshes of the model", async () => {
  const { page } = studio;
  await goTo(page, "Devices");
  await page.locator('.stage[data-placed="yes"] canvas').waitFor();
  const beside = page.getByRole("group", { name: "Drawn with the machine" });
  await beside.getByLabel("Forces").selectOption("10");
  await page.locator('.stage[data-contacts="1"]').waitFor();
  await shoot(page, "virtual-forces");
  await beside.getByLabel("Forces").selectOption("");
  await page.locator(".stage:not([data-contacts])").waitFor();
});

test("it runs at a rate until it is held, and every look passes the check of axe", async () => {
  const { page, errors } = studio;
  const clock = page.getByRole("group", { name: "Virtual clock" });
  await clock.getByLabel("Rate of the clock").selectOption("10");
  const before = await now(page);
  await command(clock.getByRole("button", { name: "Run clock" }), clock.getByRole("button", { name: "Hold clock" }));
  await expect.poll(() => now(page)).toBeGreaterThan(before + 1);
  expect(await stopRectangles(page), "the clock runs").toEqual([STOP]);
  await command(clock.getByRole("button", { name: "Hold clock" }), clock.getByRole("button", { name: "Run clock" }));
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    const wide = () => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    await expect.poll(wide, { message: `wider than ${look.width} pixels` }).toBeLessThanOrEqual(0);
    await shoot(page, `virtual-${look.width}-${look.scheme}`);
  }
  expect(errors).toEqual([]);
});
