// SPDX-License-Identifier: Apache-2.0
// Outputs are set from the page: a digital one on and off, an analog one to a value; one that a program holds stays the program's.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Commander } from "./commander";
import { axeFindings, browse, command, goTo, LOOKS, type Opened, open, type Running, run, shoot } from "./running";

let running: Running;
let browser: Browser;
let operator: Opened;
let watch: Commander;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "signals.py")), browse(false)]);
  watch = await Commander.look(running.url);
  operator = await open(browser, running.url);
  await goTo(operator.page, "Devices");
});

afterAll(async () => {
  await watch?.close();
  await browser?.close();
  await running?.stop();
});

const button = (page: Page, name: string) => page.getByRole("button", { name, exact: true });
const shown = (page: Page, svv: string, value: string) => page.locator(`.family [data-live="${svv}"]`).filter({ hasText: value });
const read = async (svv: string) =>
  (await watch.call<{ values: Record<string, { value: unknown }> }>("read", { names: [svv] })).values[svv]?.value;

test("a digital output is set on and off, and an analog one to a value", async () => {
  const { page } = operator;
  await shown(page, "part.value", "true").waitFor();
  await command(button(page, "Set valve on"), shown(page, "valve.value", "true"));
  expect(await read("valve.commanded")).toBe(true);
  await command(button(page, "Set valve off"), shown(page, "valve.value", "false"));
  const flow = page.locator(".set-output").getByLabel("New value of flow");
  await flow.fill("12,5");
  expect(await button(page, "Set flow").isDisabled()).toBe(true);
  await flow.fill("12.5");
  await command(button(page, "Set flow"), shown(page, "flow.value", "12.5"));
  expect(await read("flow.value")).toBe(12.5);
  await expect.poll(async () => (await watch.instances()).filter((one) => one.verb.startsWith("set_")).length).toBe(0);
});

test("an output that a program holds is not set, and the holder is named", async () => {
  const { page } = operator;
  await command(button(page, "Set lamp off"), page.getByRole("alert").getByText(/pulse_output/));
  expect(await read("lamp.value")).toBe(true);
  // All of the message is in sight.
  const message = page.getByRole("alert").filter({ hasText: "pulse_output" });
  expect(await message.evaluate((one) => one.scrollWidth - one.clientWidth)).toBeLessThanOrEqual(0);
});

test("an input has nothing to set; axe finds nothing, at any width", async () => {
  const { page, errors } = operator;
  expect(await page.getByRole("button", { name: /^Set part/ }).count()).toBe(0);
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    await shoot(page, `signals-${look.width}-${look.scheme}`);
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth)).toBe(true);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  expect(errors).toEqual([]);
});

test("an output that is disabled says so, and stays safe", async () => {
  const { page } = operator;
  const all = page.getByRole("region", { name: "digital_output" }).getByRole("button", { name: "Disable all" });
  const row = page.locator(".family tr").filter({ has: page.getByRole("link", { name: "valve" }) });
  await command(all, row.getByText("disabled"));
  await command(button(page, "Set valve on"), page.getByRole("alert").getByText("'valve' is not enabled, so nothing was changed."));
  expect(await read("valve.value")).toBe(false);
});

test("a page that only looks sees outputs and points, and has nothing to press", async () => {
  const looking = await run(join(import.meta.dirname, "points.py"), "--role", "observe");
  const { page, context } = await open(browser, looking.url);
  await goTo(page, "Devices");
  await page.getByText("standstill").first().waitFor();
  await page
    .getByRole("region", { name: /^Tool of ur5e/ })
    .locator("[data-pose]")
    .first()
    .waitFor();
  await page.getByRole("region", { name: "Points of ur5e" }).getByText("above the tray").waitFor();
  expect(await page.locator(".set-output, .tool-axes, .jog").count()).toBe(0);
  expect(await page.getByRole("button", { name: /Teach|Move joints|Set / }).count()).toBe(0);
  await context.close();
  await looking.stop();
});
