// SPDX-License-Identifier: Apache-2.0
// Times within which a page notices that it no longer hears the system, and says what became of an emergency stop. The page's clock
// stands still and is moved by the test, so that the bounds are exact on any machine; a campaign in link.test.ts measures them with real
// time.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import { Link } from "./link";
import { browse, PATIENCE_MS, type Running, run, shoot } from "./running";

/** Time after which nothing on the page may look current if nothing arrives, and after which a press has an outcome, ms. */
const NOTICED_MS = 1000;
const TOLD_MS = 300;

let running: Running;
let browser: Browser;
let link: Link;
let page: Page;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "people.py"), "--role", "configure"), browse(false)]);
  link = await Link.to(Number(new URL(running.url).port));
});

afterEach(async () => {
  // A pending emergency stop, in the page or in the link, must not reach the system.
  await page?.context().close();
  link.cut();
  link.thaw();
  link.mend();
  link.drop(false);
});

afterAll(async () => {
  await browser?.close();
  link?.close();
  await running?.stop();
});

/** Opens a view in a page whose clock stands still as soon as the page hears the system and shows its values. */
async function still(view: string): Promise<void> {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 } });
  context.setDefaultTimeout(PATIENCE_MS);
  page = await context.newPage();
  await page.clock.install();
  const url = new URL(running.url);
  url.port = String(link.port);
  await page.goto(`${url.origin}/#/${view}&${url.hash.slice(1)}`);
  await expect.poll(isHeard).toBe("yes");
  const values = () => page.locator("[data-live]").allTextContents();
  await expect.poll(async () => (await values()).some((one) => one !== "–")).toBe(true);
  // The clock jumps to the time at which it stands still, so the page may first hear nothing, and then the system again.
  await pauseSoon();
  await expect.poll(isHeard).toBe("yes");
}

/** Stops the page's clock. A busy machine may reach the requested time too late; the clock then already stands still. */
async function pauseSoon(): Promise<void> {
  for (;;) {
    const refused = await page.clock.pauseAt(await page.evaluate(() => Date.now() + 500)).catch((why: Error) => why);
    if (!refused) return;
    if (!refused.message.includes("Cannot fast-forward to the past")) throw refused;
  }
}

const isHeard = () => page.locator(".shell").getAttribute("data-heard");

test.each([
  ["freezes", () => link.freeze()],
  ["drops all that is sent", () => link.drop(true)],
  ["is cut", () => link.cut()],
])("one second after a network %s, everything is grey with its age, and the page says that there is no connection", async (_, begin) => {
  await still("devices");
  begin();
  for (let passed = 0; passed < NOTICED_MS && (await isHeard()) === "yes"; passed += 50) await page.clock.runFor(50);
  expect(await isHeard()).toBe("no");
  await page.getByText("No connection.").waitFor();
  const age = await page.locator(".unheard .figures").textContent();
  expect(Number.parseFloat(age ?? ""), `the age is '${age}'`).toBeLessThanOrEqual(NOTICED_MS / 1000);
  const coloured = await page.evaluate(() => {
    const quiet = document.createElement("span");
    quiet.style.color = "var(--quiet)";
    document.body.append(quiet);
    const grey = getComputedStyle(quiet).color;
    quiet.remove();
    const values = [...document.querySelectorAll<HTMLElement>("main [data-live]")].filter((one) => one.checkVisibility());
    return { count: values.length, notGrey: values.filter((one) => getComputedStyle(one).color !== grey).map((one) => one.dataset.live) };
  });
  expect(coloured.count).toBeGreaterThan(3);
  expect(coloured.notGrey).toEqual([]);
});

test.each([
  ["freezes", async () => link.freeze()],
  ["drops all that is sent", async () => link.drop(true)],
  ["is cut", async () => link.cut()],
  ["answers for the system", () => page.route("**/emergency_stop", (route) => route.fulfill({ status: 503, body: "full" }))],
])("0.3 s after a press of the emergency stop while the network %s, the page shouts that it was not received", async (how, begin) => {
  await still("panel/joint");
  await begin();
  await page.getByRole("button", { name: "Emergency stop" }).click();
  await page.clock.runFor(TOLD_MS);
  await page.locator("button.stop.unheard").waitFor();
  await page.getByText("The emergency stop was not received.").waitFor();
  if (how === "freezes") await shoot(page, "bounds-unheard");
});

test("a press of the emergency stop that the system has received is told by its answer, before any of that time has passed", async () => {
  await still("panel/joint");
  await page.getByRole("button", { name: "Emergency stop" }).click();
  await page.locator("button.stop.heard").waitFor();
  expect(await page.getByText("The emergency stop was not received.").count()).toBe(0);
});
