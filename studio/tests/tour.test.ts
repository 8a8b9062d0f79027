// SPDX-License-Identifier: Apache-2.0
// The tour of the first page: five steps with a simulated arm, each noticed when it was done, by the controls that a person presses.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Commander } from "./commander";
import { axeFindings, browse, command, goTo, LOOKS, type Opened, open, type Running, run, shoot, standsStill } from "./running";

let running: Running;
let browser: Browser;
let studio: Opened;
let watch: Commander;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "bare_arm.py")), browse(false)]);
  studio = await open(browser, running.url);
  watch = await Commander.look(running.url);
});

afterAll(async () => {
  await watch?.close();
  await browser?.close();
  await running?.stop();
});

const tourOf = (page: Page) => page.getByRole("region", { name: "Tour", exact: true });
const done = (page: Page) => tourOf(page).getByRole("status").getByText("done");

/** Goes to the next step, and returns its heading. */
async function next(page: Page): Promise<string> {
  await tourOf(page).getByRole("button", { name: "Next step" }).click();
  return (await tourOf(page).locator("strong").textContent()) ?? "";
}

test("the tour is offered, has the same height at every step, and can be left at any time", async () => {
  const { page } = studio;
  await page.getByRole("button", { name: "Take the tour" }).click();
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    const heights = new Set<number>();
    for (let step = 1; step <= 5; step++) {
      await tourOf(page).getByText(`Step ${step} of 5`).waitFor();
      heights.add((await tourOf(page).boundingBox())?.height ?? 0);
      if (step < 5) await next(page);
    }
    expect([...heights].length, `at ${look.width}: ${[...heights]}`).toBe(1);
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth)).toBe(true);
    await shoot(page, `tour-${look.width}-${look.scheme}`);
    await tourOf(page).getByRole("button", { name: "Leave tour" }).click();
    await tourOf(page).waitFor({ state: "detached" });
    await page.getByRole("button", { name: "Take the tour" }).click();
  }
  await page.setViewportSize({ width: 1440, height: 900 });
});

test("each step is noticed when it was done, and the tour itself commands nothing", async () => {
  const { page, errors } = studio;
  // The program has enabled the arm.
  await done(page).waitFor();
  expect(await next(page)).toBe("Jog a joint");
  expect(await done(page).count()).toBe(0);
  expect(await watch.instances()).toEqual(expect.not.arrayContaining([expect.objectContaining({ verb: "jog" })]));
  await tourOf(page).getByRole("link", { name: "Open Devices" }).click();
  const jog = page.getByRole("button", { name: "Jog wrist_3 forward while held" });
  await jog.hover();
  await standsStill(jog);
  await page.mouse.down();
  await expect.poll(async () => Math.abs(await watch.value("ur5e.wrist_3.sensed"))).toBeGreaterThan(0.01);
  await page.mouse.up();
  await done(page).waitFor();
  expect(await next(page)).toBe("Watch a value");
  await tourOf(page).getByRole("link", { name: "Open Scope" }).click();
  await done(page).waitFor();
  expect(await next(page)).toBe("Move to a position");
  await tourOf(page).getByRole("link", { name: "Open Verbs" }).click();
  const form = page.locator("form.start");
  const goal = form.getByRole("group", { name: "goal" });
  const present = goal.getByRole("button", { name: "Present" });
  await standsStill(present);
  await present.click();
  await expect.poll(() => goal.getByLabel("wrist_3").inputValue()).not.toBe("");
  await goal.getByLabel("wrist_3").fill("-20 deg");
  await command(form.getByRole("button", { name: "Start" }), done(page));
  expect(await next(page)).toBe("Stop, and reset");
  await page.getByRole("button", { name: "Emergency stop" }).click();
  const reset = page.getByRole("button", { name: "Reset", exact: true });
  await reset.waitFor();
  expect(await done(page).count()).toBe(0);
  await command(reset, done(page));
  await tourOf(page).getByRole("button", { name: "Finish tour" }).click();
  await tourOf(page).waitFor({ state: "detached" });
  await goTo(page, "Start");
  await page.getByRole("button", { name: "Take the tour" }).waitFor();
  expect(errors).toEqual([]);
});
