// SPDX-License-Identifier: Apache-2.0
// Forced signals: an input and an output are forced from the page, marked wherever they are shown, and released by one press.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Commander } from "./commander";
import { axeFindings, browse, command, goTo, LOOKS, type Opened, open, type Running, run, shoot, show } from "./running";

let running: Running;
let browser: Browser;
let operator: Opened;
let watch: Commander;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "signals.py"), "--role", "configure"), browse(false)]);
  watch = await Commander.look(running.url);
  operator = await open(browser, running.url);
  await show(operator.page, "#/devices/part");
});

afterAll(async () => {
  await watch?.close();
  await browser?.close();
  await running?.stop();
});

const button = (page: Page, name: string) => page.getByRole("button", { name, exact: true });
const note = (page: Page) => page.getByRole("status", { name: "Forced signals" });
const read = async (name: string) =>
  (await watch.call<{ values: Record<string, { value: unknown }> }>("read", { names: [name] })).values[name]?.value;
const forced = async () => Object.keys(await watch.call<object>("forced", {}));

test("a newcomer finds forcing: from the first page, and from the table of the signals", async () => {
  const { page } = operator;
  await goTo(page, "Start");
  await page.getByRole("link", { name: /^Force a signal/ }).click();
  await page.getByRole("region", { name: "Forcing of part" }).waitFor();
  // In a low window the panel is below the tables: it comes into sight.
  await page.setViewportSize({ width: 1440, height: 500 });
  await page.getByRole("link", { name: "Force… flow" }).click();
  await expect
    .poll(() =>
      page.getByRole("button", { name: "Force flow", exact: true }).evaluate((one) => one.getBoundingClientRect().bottom <= innerHeight),
    )
    .toBe(true);
  await page.setViewportSize({ width: 1440, height: 900 });
  await show(page, "#/devices/part");
});

test("an input is forced, marked in every view that shows it, and the alarm stands", async () => {
  const { page } = operator;
  await page.getByRole("region", { name: "Forcing of part" }).getByText("not forced").waitFor();
  await command(button(page, "Force off: part"), note(page).getByText("1 signal is forced"));
  await expect.poll(() => read("part.value")).toBe(false);
  await page.locator('.live.forced [data-live="part.value"]').first().waitFor();
  await page.locator(".family .tag").getByText("forced false").waitFor();
  await page.getByText("10 channels").or(page.getByText("channels")).first().click();
  await page.locator(".channels .live.forced").first().waitFor();
  await page.getByRole("status", { name: "Alarms" }).getByText("forced", { exact: true }).waitFor();
  await show(page, "#/scope?names=part.value");
  await page.locator('tr[data-trace="part.value"] .tag').getByText("forced").waitFor();
  await note(page).waitFor();
  await goTo(page, "Log");
  await page
    .locator("main")
    .getByText(/to false, by/)
    .first()
    .waitFor();
});

test("an output is forced over the program, and one press releases all", async () => {
  const { page } = operator;
  await show(page, "#/devices/flow");
  await page.getByLabel("Value to force flow to").fill("7.5");
  await command(button(page, "Force flow"), note(page).getByText("2 signals are forced"));
  await expect.poll(forced).toEqual(["part", "flow"]);
  await command(button(page, "Release all"), note(page), "detached");
  await expect.poll(forced).toEqual([]);
  await expect.poll(() => read("part.value")).toBe(true);
  expect(await page.locator(".live.forced").count()).toBe(0);
});

test("a value beyond the limits is refused at its field, and nothing is forced", async () => {
  const { page } = operator;
  await page.getByLabel("Value to force flow to").fill("1e6");
  await command(button(page, "Force flow"), page.getByRole("region", { name: "Forcing of flow" }).getByText(/the range of the output is/));
  expect(await forced()).toEqual([]);
});

test("at every width nothing moves when a signal is forced, and axe finds nothing", async () => {
  const { page, errors } = operator;
  await show(page, "#/devices/part");
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    const place = async () => JSON.stringify(await button(page, "Force on: part").boundingBox());
    await button(page, "Force on: part").scrollIntoViewIfNeeded();
    const before = await place();
    await command(button(page, "Force off: part"), note(page));
    expect(await place(), `at ${look.width}`).toBe(before);
    await shoot(page, `forcing-${look.width}-${look.scheme}`);
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth)).toBe(true);
    await command(button(page, "Release part"), note(page), "detached");
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  expect(errors).toEqual([]);
});

test("a page that is closed takes its forces along, and a page that operates may only release", async () => {
  const other = await open(browser, running.url);
  await operator.page.close();
  // The first page's session gives command back when it is lost.
  await expect.poll(() => watch.holder(), { timeout: 30_000 }).toBe(null);
  await show(other.page, "#/devices/part");
  await command(button(other.page, "Force off: part"), note(other.page));
  await other.context.close();
  await expect.poll(forced, { timeout: 30_000 }).toEqual([]);
  const log = await watch.call<{ kind: string; text: string }[]>("log", { since: 0 });
  expect(log.filter((entry) => entry.kind === "release").at(-1)?.text).toMatch(/^session '.*' was (lost|closed)$/);
});
