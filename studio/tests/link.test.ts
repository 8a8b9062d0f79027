// SPDX-License-Identifier: Apache-2.0
// A network between an operator's page and its system that freezes, delays, drops and cuts; and a page that is closed.
import { connect } from "node:net";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import { Commander } from "./commander";
import { Link } from "./link";
import { browse, command, type Opened, open, type Running, run, shoot, show, standsStill } from "./running";

/** Number of presses of the emergency stop; a campaign on a quiet machine sets it, and checks times. */
const STOPS = Number(process.env.OPENGPAC_STOPS ?? 18);
const IS_CAMPAIGN = process.env.OPENGPAC_STOPS !== undefined;

let running: Running;
let browser: Browser;
let link: Link;
let operator: Opened;
let watch: Commander;

/** Returns the page's address through the link. */
function linked(): string {
  const url = new URL(running.url);
  url.port = String(link.port);
  return url.href;
}

const button = (page: Page, label: string) => page.locator(`[data-button="${label}"]`);

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "people.py"), "--role", "configure"), browse(false)]);
  link = await Link.to(Number(new URL(running.url).port));
  watch = await Commander.look(running.url);
  operator = await open(browser, linked());
});

afterEach(() => {
  link.thaw();
  link.mend();
  link.delay(0);
  link.drop(false);
  link.hold(false);
});

afterAll(async () => {
  await watch?.close();
  await browser?.close();
  link?.close();
  await running?.stop();
});

test("an instance of the program outlives the page that started it", async () => {
  const { page, context } = await open(browser, running.url);
  const before = await watch.instances();
  const session = await page.evaluate(() => sessionStorage.getItem("opengpac.session"));
  await show(page, "#/panel/joint");
  await command(button(page, "Home").getByRole("button", { name: "Home", exact: true }), button(page, "Home").getByText(/running|ended/));
  await context.close();
  await expect.poll(async () => (await watch.sessions()).find((one) => one.name === session)?.alive ?? false).toBe(false);
  // Opening a session first handles the instances of lost ones.
  const again = await open(browser, running.url);
  await show(again.page, "#/panel/joint");
  const home = button(again.page, "Home");
  await command(home.getByRole("button", { name: "Home", exact: true }), home.getByText(/running|ended/));
  expect((await watch.instances()).map((one) => one.name)).toEqual(before.map((one) => one.name));
  await again.context.close();
});

/** Waits until the page shows current data. */
const isHeard = (page: Page) => page.locator('.shell[data-heard="yes"]').waitFor();
const isUnheard = (page: Page) => page.locator('.shell[data-heard="no"]').waitFor();

test.each([
  ["freezes", () => link.freeze(), () => link.thaw()],
  ["drops all that is sent", () => link.drop(true), () => link.drop(false)],
  ["delays all by two seconds", () => link.delay(2000), () => link.delay(0)],
  ["is cut", () => link.cut(), () => link.mend()],
])("a network that %s is seen within a second, and what is shown is grey with its age", async (how, begin, end) => {
  const { page } = operator;
  await isHeard(page);
  // The page's own figure is the age of the newest data when it notices, independent of this machine's speed.
  await page.evaluate(() => {
    const noticed = window as unknown as { noticed: Promise<string> };
    noticed.noticed = new Promise((found) => {
      const look = () => {
        const said = document.querySelector(".unheard .figures")?.textContent;
        if (said) found(said);
        else requestAnimationFrame(look);
      };
      look();
    });
  });
  begin();
  await isUnheard(page);
  await page.getByText("No connection.").waitFor();
  const age = await page.evaluate(() => (window as unknown as { noticed: Promise<string> }).noticed);
  expect(age).toMatch(/^[\d.]+ s$/);
  if (IS_CAMPAIGN) expect(Number.parseFloat(age), `noticed when it was ${age} old`).toBeLessThanOrEqual(1);
  if (how === "freezes")
    for (const width of [1440, 800, 390]) {
      await page.setViewportSize({ width, height: 900 });
      await shoot(page, `no-connection-${width}`);
    }
  end();
  await page.getByText("No connection.").waitFor({ state: "detached" });
  await isHeard(page);
});

test("a press that is held up moves nothing when the network goes on", async () => {
  const { page } = operator;
  await isHeard(page);
  await show(page, "#/panel/joint");
  const home = button(page, "Home").getByRole("button", { name: "Home", exact: true });
  await home.waitFor();
  await button(page, "Home")
    .getByText(/^ended/)
    .waitFor();
  await page.locator(".holder").getByText("nobody").waitFor();
  const before = await watch.starts();
  await standsStill(home);
  link.freeze();
  // Pressed before the page can know that nothing arrives.
  await home.click();
  await isUnheard(page);
  link.thaw();
  await button(page, "Home")
    .getByText(/arrived \d+ ms after it was issued/)
    .waitFor();
  expect(await watch.starts()).toBe(before);
  // If pressed when the page knows that there is no connection, it is not even sent.
  link.freeze();
  await isUnheard(page);
  await standsStill(home);
  await home.click();
  await button(page, "Home").getByText("no connection to the system").waitFor();
  link.thaw();
  await isHeard(page);
  expect(await watch.starts()).toBe(before);
});

test("the emergency stop says at once whether it was heard, and shouts when not", { timeout: 400_000 + STOPS * 5_000 }, async () => {
  const { page } = operator;
  await goToPanel(page);
  await page.evaluate(() => {
    const said = window as unknown as { said: [string, number][] };
    said.said = [];
    const stop = document.querySelector("button.stop") as HTMLElement;
    let pressed = 0;
    stop.addEventListener("pointerdown", (event) => {
      pressed = event.timeStamp;
    });
    let before = "";
    new MutationObserver(() => {
      const now = ["heard", "unheard", "refused"].find((one) => stop.classList.contains(one)) ?? "";
      if (now !== "" && now !== before) said.said.push([now, performance.now() - pressed]);
      before = now;
    }).observe(stop, { attributes: true });
  });
  const stop = page.getByRole("button", { name: "Emergency stop" });
  const shout = page.getByText("The emergency stop was not received.");
  const told = () => page.evaluate(() => (window as unknown as { said: [string, number][] }).said.splice(0));
  const first = new Map<string, number[]>();
  const ways = ["freezes", "is cut", "is answered for", "is crowded", "is busy", "works"];
  for (let index = 0; index < STOPS; index += 1) {
    const how = ways[index % ways.length] as string;
    const isLost = index % ways.length < 3;
    await isHeard(page);
    let after = async () => {};
    if (how === "freezes") link.freeze();
    if (how === "is cut") link.cut();
    if (how === "is answered for") after = await answered(page);
    if (how === "is crowded") after = await crowded();
    if (how === "is busy") after = await busy(page);
    await stop.click();
    if (isLost) {
      await shout.waitFor();
      if (index < 2)
        for (const width of [1440, 800, 390]) {
          await page.setViewportSize({ width, height: 900 });
          await shoot(page, `stop-unheard-${width}`);
        }
      link.thaw();
      link.mend();
      await after();
    }
    await page.locator(".stopped").getByText("pressed in the studio").waitFor();
    await shout.waitFor({ state: "detached" });
    const [what] = await told();
    if (!isLost) await after();
    // An answer that is too late, as on a busy machine, is first reported as missing, then as heard.
    expect(isLost ? ["unheard"] : ["heard", "unheard"], how).toContain(what?.[0]);
    first.set(how, [...(first.get(how) ?? []), what?.[1] ?? Infinity]);
    await isHeard(page);
    // Messages appear and disappear at this time without moving the reset button: the first press is accepted.
    await command(page.getByRole("button", { name: "Reset", exact: true }), page.locator(".stopped"), "detached");
    await page.locator("button.stop.none").waitFor();
    await told();
  }
  const longest = [...first].map(([how, told_ms]) => [how, Math.max(...told_ms)] as const);
  process.stdout.write(
    `emergency stop: ${STOPS} presses, told at the latest (ms): ${longest.map(([how, ms]) => `${how} ${ms.toFixed(0)}`).join(", ")}\n`,
  );
  // A busy page reports it when it has time, as does one on a busy machine.
  if (!IS_CAMPAIGN) return;
  for (const [how, ms] of longest) if (how !== "is busy") expect(ms, how).toBeLessThanOrEqual(300);
});

test("a stop is heard while no answer comes to what the page has asked for", async () => {
  const { page } = operator;
  await goToPanel(page);
  await isHeard(page);
  link.hold(true);
  for (const view of ["recordings", "verbs", "devices", "system", "log", "flow"]) {
    await show(page, `#/${view}`);
    await page.waitForFunction((hash) => window.location.hash === hash, `#/${view}`);
  }
  await expect.poll(() => link.held).toBeGreaterThanOrEqual(3);
  await page.getByRole("button", { name: "Emergency stop" }).click();
  // Without a free connection it would wait for a minute, until the browser gives up one of the held ones.
  await page.locator("button.stop.heard").waitFor({ timeout: 10_000 });
  await page.locator(".stopped").getByText("pressed in the studio").waitFor();
  link.hold(false);
  await goToPanel(page);
  await command(page.getByRole("button", { name: "Reset", exact: true }), page.locator(".stopped"), "detached");
});

test("a view that was not opened before can be opened without a connection", async () => {
  const { page, context } = await open(browser, linked());
  await expect.poll(() => hasFetched(page, "panel")).toBe(true);
  link.cut();
  await isUnheard(page);
  await show(page, "#/recordings");
  await page.getByRole("main", { name: "Recordings" }).getByRole("button", { name: "Record", exact: true }).waitFor();
  await context.close();
});

test("a view that could not be loaded says so, and is shown when the connection returns", async () => {
  const { page, context } = await open(browser, linked());
  await failsToLoadRecordings(page);
  link.cut();
  await isUnheard(page);
  await show(page, "#/recordings");
  await page.getByText("The page is loaded again when the connection returns.").waitFor();
  await page.unroute("**/assets/recordings-*");
  link.mend();
  await page.getByRole("main", { name: "Recordings" }).getByRole("button", { name: "Record", exact: true }).waitFor();
  await context.close();
});

test("a view that could not be loaded although there is a connection is loaded with the page, and later views are fetched", async () => {
  const { page, context } = await open(browser, linked());
  await failsToLoadRecordings(page);
  // Views after it are fetched nevertheless.
  await expect.poll(() => hasFetched(page, "panel")).toBe(true);
  await show(page, "#/recordings");
  await page.getByText("This view could not be loaded. Load the page again.").waitFor();
  await page.unroute("**/assets/recordings-*");
  await page.getByRole("button", { name: "Load page again" }).click();
  await page.getByRole("main", { name: "Recordings" }).getByRole("button", { name: "Record", exact: true }).waitFor();
  await context.close();
});

/** Loads the page again, and from then on lets no part of the view of recordings through. */
async function failsToLoadRecordings(page: Page): Promise<void> {
  // Before the page is loaded, because it soon fetches all views.
  await page.route("**/assets/recordings-*", (route) => route.abort());
  await page.reload();
  await page.getByText("live", { exact: true }).waitFor();
}

const hasFetched = (page: Page, view: string) =>
  page.evaluate((part) => performance.getEntriesByType("resource").some((one) => one.name.includes(part)), `/assets/${view}-`);

/** Makes something between page and system answer the stop: it is overloaded, or has no capacity. Returns a function that ends this. */
async function answered(page: Page): Promise<() => Promise<void>> {
  let status = 503;
  await page.route("**/emergency_stop", (route) => {
    status = status === 503 ? 429 : 503;
    return route.fulfill({ status, headers: { "Retry-After": "2" }, body: "full" });
  });
  return () => page.unroute("**/emergency_stop");
}

/** Opens all 64 connections that a caller may have, and tries more. Returns a function that closes them. */
async function crowded(): Promise<() => Promise<void>> {
  const { host, hash, port } = new URL(running.url);
  const token = decodeURIComponent(hash.replace("#token=", ""));
  const opened = Array.from({ length: 80 }, () => connect(Number(port), "127.0.0.1"));
  await Promise.all(
    opened.map(async (socket) => {
      socket.on("error", () => {});
      socket.write(`GET /v1/sessions HTTP/1.1\r\nHost: ${host}\r\nAuthorization: Bearer ${token}\r\n\r\n`);
      await new Promise((answer) => socket.once("data", answer).once("close", answer));
    }),
  );
  return async () => {
    for (const socket of opened) socket.destroy();
  };
}

/** Makes the page compute for 50 ms of each 60. Returns a function that ends this. */
async function busy(page: Page): Promise<() => Promise<void>> {
  const beat = await page.evaluate(() =>
    Number(
      window.setInterval(() => {
        const until = performance.now() + 50;
        while (performance.now() < until);
      }, 60),
    ),
  );
  return () => page.evaluate((one) => window.clearInterval(one), beat);
}

async function goToPanel(page: Page): Promise<void> {
  await page.setViewportSize({ width: 1440, height: 900 });
  await show(page, "#/panel/joint");
  await button(page, "Home").waitFor();
}
