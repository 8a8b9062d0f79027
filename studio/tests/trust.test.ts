// SPDX-License-Identifier: Apache-2.0
// Displays that must never deceive: the position of the emergency stop, the commanding session, the age of values, typed input, the effect
// of a button.
import { join } from "node:path";
import type { Browser, Page, WebSocketRoute } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Commander } from "./commander";
import {
  axeFindings,
  browse,
  command,
  goTo,
  type Opened,
  open,
  PATIENCE_MS,
  type Running,
  run,
  STOP,
  shoot,
  show,
  stopRectangles,
} from "./running";

const JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"];

let running: Running;
let browser: Browser;
let studio: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "program.py"), "--role", "configure"), browse()]);
  studio = await open(browser, running.url);
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
});

/** Fills the form of the verb that moves the joint: far and slowly. */
async function fillMove(page: Page, limit: string): Promise<void> {
  await goTo(page, "Verbs");
  await page
    .locator(".verb-list")
    .getByRole("link", { name: /^move_absolute/ })
    .click();
  const form = page.locator("form.start");
  for (const joint of JOINTS) await form.getByRole("checkbox", { name: joint }).setChecked(joint === "wrist_3");
  await form.getByRole("group", { name: "goal" }).getByLabel("wrist_3").fill("170 deg");
  await form.getByRole("group", { name: "speed" }).getByLabel("wrist_3").fill("0.05");
  await form.getByLabel("Time limit").fill(limit);
}

test("the emergency stop stands where it stands in every state and width while nothing is wrong", async () => {
  expect(await stopRectangles(studio.page)).toEqual([STOP]);
});

test("while no session commands, what a program has started is told", async () => {
  const said = studio.page.locator(".holder");
  await said.getByText("a program: sway#1 and 1 more").waitFor();
  expect(await said.getAttribute("title")).toContain("sway#2");
});

test("a driver's counters and services are seen, and a service is asked for by its form", async () => {
  const { page, errors } = studio;
  await goTo(page, "Devices");
  const panel = page.locator("section").filter({ has: page.getByRole("heading", { name: "Physical device drives" }) });
  await panel.getByText("safe state:").waitFor();
  await expect.poll(() => panel.locator("[data-counter]").first().textContent()).toMatch(/\d/);
  await panel.getByText(/services:/).click();
  const place = panel.getByRole("form", { name: "Service place of drives" });
  await command(place.getByRole("button", { name: "Call" }), place.getByText("enter a value"));
  await place.getByLabel("part").fill("x");
  await place.getByLabel("position").fill("0,5");
  await command(place.getByRole("button", { name: "Call" }), place.getByText("write 0.5"));
  await place.getByLabel("position").fill("0.5");
  await command(place.getByRole("button", { name: "Call" }), place.getByText("done", { exact: true }));
  await panel.getByText(/channels/).click();
  await expect.poll(() => panel.locator('[data-live="drives.x.position"]').textContent()).toBe("0.5000");
  await shoot(page, "devices-services");
  expect(await axeFindings(page)).toEqual([]);
  expect(errors).toEqual([]);
});

test("the right mouse button moves no joint", async () => {
  const { page } = studio;
  await goTo(page, "Devices");
  const asked: string[] = [];
  const hear = (request: { url: () => string }) => asked.push(request.url());
  page.on("request", hear);
  const forward = page.getByRole("button", { name: "Jog wrist_3 forward while held" });
  await forward.click({ button: "right" });
  await forward.click({ button: "middle" });
  // The effects of a press come before those of the following action.
  await page.getByRole("button", { name: "Front" }).click();
  await page.evaluate(() => fetch("/v1/version"));
  page.off("request", hear);
  expect(asked.filter((url) => url.includes("/v1/call/create"))).toEqual([]);
});

test("a time limit is read as the package reads it, or refused with a sentence; nothing starts without it", async () => {
  const { page } = studio;
  await fillMove(page, "1,5 s");
  const form = page.locator("form.start");
  const start = form.getByRole("button", { name: "Start" });
  await command(start, form.getByText("'1,5 s' has a decimal comma: write 1.5"));
  await form.getByLabel("Time limit").fill("soon");
  await command(start, form.getByText("'soon' is not a number with a unit"));
  const started = page.waitForRequest((request) => request.url().endsWith("/v1/call/start"));
  await fillMove(page, "2.5 min");
  await command(start, page.locator(".instances li").filter({ hasText: "running" }));
  expect((await started).postDataJSON().limits).toEqual({ time_limit_ns: 150_000_000_000 });
});

test("who has lost command can still halt what he has started", async () => {
  const { page } = studio;
  const instance = page.locator(".instances li").filter({ hasText: "running" });
  await instance.waitFor();
  const other = await Commander.open(running.url, true);
  await page.locator(".holder").getByText("commander", { exact: true }).waitFor();
  const name = (await instance.getByRole("link").textContent()) ?? "";
  const ended = page.locator(".instances li").filter({ hasText: name }).getByText("ended");
  await command(instance.getByRole("button", { name: "Halt" }), ended);
  expect(await other.holder()).toBe("commander");
  await other.close();
});

test("an alarm is seen in every view, and acknowledged where it is seen", async () => {
  const { page } = studio;
  const other = await Commander.open(running.url, true);
  await other.call("define_alarm", { code: "E7", text: "oil is low", remedy: "refill it", severity: "high" });
  await other.call("raise_alarm", { code: "E7", source: "press", text: "oil is low" });
  for (const view of ["Log", "Scope", "Devices"]) {
    await goTo(page, view);
    await page.getByRole("status", { name: "Alarms" }).getByText("press: oil is low").waitFor();
  }
  await other.close();
  const acknowledge = page.getByRole("button", { name: "Acknowledge E7 of press" });
  await command(acknowledge, acknowledge, "detached");
});

test("the emergency stop stands at one place in every state and width, and says what became of a press", async () => {
  const { page, context } = await open(browser, running.url);
  await page.getByRole("status", { name: "Alarms" }).waitFor();
  for (const view of ["System", "Data flow", "Verbs", "Devices", "Scope", "Log", "Recordings", "Workspaces"]) {
    await goTo(page, view);
    expect(await stopRectangles(page), `${view}, with an alarm`).toEqual([STOP]);
  }
  await page.getByRole("button", { name: "Pause page" }).click();
  await page.getByText("Paused", { exact: true }).waitFor();
  expect(await stopRectangles(page), "the page is paused").toEqual([STOP]);
  await page.getByRole("button", { name: "Live", exact: true }).click();
  await page.route("**/v1/call/emergency_stop", (route) => route.abort());
  await page.getByRole("button", { name: "Emergency stop" }).click();
  const failed = page.getByText("The emergency stop was not received.");
  await failed.waitFor();
  expect(await stopRectangles(page), "a press was not heard").toEqual([STOP]);
  // It is resent until it is heard.
  await page.unroute("**/v1/call/emergency_stop");
  await page.locator(".stopped").getByText("pressed in the studio").waitFor();
  await failed.waitFor({ state: "detached" });
  expect(await stopRectangles(page), "latched").toEqual([STOP]);
  for (const width of [1440, 800, 390]) {
    await page.setViewportSize({ width, height: 900 });
    await shoot(page, `latched-${width}`);
    expect(await axeFindings(page), `${width}`).toEqual([]);
  }
  await context.close();
});

test("values of a device that is disabled are grey, and say how old they are", async () => {
  const { page } = studio;
  await goTo(page, "Devices");
  const row = page.locator("table.family tr").filter({ has: page.getByRole("link", { name: "wrist_3" }) });
  await row.getByText("disabled").waitFor();
  await row.getByText(/(s|min) old$/).waitFor();
  expect(await row.getAttribute("class")).toContain("old");
  await shoot(page, "devices-disabled");
  await command(page.getByRole("button", { name: "Reset" }), page.locator(".stopped"), "detached");
  await command(page.getByRole("button", { name: "Enable all" }).first(), row.getByText("standstill"));
  await row.getByText(/old$/).waitFor({ state: "detached" });
});

test("a page that is not heard says so over its whole width, and shows nothing as of now", async () => {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 } });
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  let sockets: WebSocketRoute[] = [];
  let isCut = false;
  await page.routeWebSocket(/\/v1\/stream/, (socket) => {
    if (isCut) return void socket.close();
    socket.connectToServer();
    sockets.push(socket);
  });
  await page.goto(running.url);
  await page.getByText("live", { exact: true }).waitFor();
  await goTo(page, "Devices");
  isCut = true;
  for (const socket of sockets) await socket.close();
  sockets = [];
  await page.getByText("No connection.").waitFor();
  await page.locator('.shell[data-heard="no"]').waitFor();
  expect(await stopRectangles(page), "not heard").toEqual([STOP]);
  await shoot(page, "not-heard");
  expect(await axeFindings(page)).toEqual([]);
  isCut = false;
  await page.getByText("live", { exact: true }).waitFor();
  await page.getByText("No connection.").waitFor({ state: "detached" });
  await context.close();
});

test("no machine is drawn in a pose that nobody has told", async () => {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 } });
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  // The stream is held back: the shape is known, the joint positions are not.
  let let_through: () => void = () => undefined;
  const held = new Promise<void>((go) => {
    let_through = go;
  });
  await page.routeWebSocket(/\/v1\/stream/, (socket) => {
    const server = socket.connectToServer();
    server.onMessage(async (message) => {
      if (String(message).includes('"svvs"')) await held;
      socket.send(message);
    });
  });
  await page.goto(`${new URL("/", running.url).href}#/devices&${new URL(running.url).hash.slice(1)}`);
  await page.locator('.stage[data-placed="no"] canvas').waitFor();
  await page.getByText("Waiting for its position").waitFor();
  let_through();
  await page.locator('.stage[data-placed="yes"] canvas').waitFor();
  await context.close();
});

/** Answers each of these calls of a page with this status, as often as it says; returns the numbers of calls so far. */
async function turnedAway(page: Page, status: number, times: number, calls: readonly string[]): Promise<Map<string, number>> {
  const made = new Map<string, number>();
  await page.route(/\/v1\/call\/\w+$/, (route) => {
    const call = route.request().url().split("/").at(-1) ?? "";
    if (!calls.includes(call)) return route.continue();
    made.set(call, (made.get(call) ?? 0) + 1);
    const errors = [{ class: "InvalidState", message: "internal error in OpenGPAC", remedy: "please report it" }];
    return (made.get(call) ?? 0) > times ? route.continue() : route.fulfill({ status, json: { errors } });
  });
  return made;
}

test("what the system could not answer at first is shown as soon as it can: the tour, the scope's parameters, a ghost", async () => {
  const { page, context } = await open(browser, running.url);
  for (const [view, calls, shown] of [
    ["#/start", ["configuration", "names", "geometry"], page.getByRole("button", { name: "Take the tour" })],
    ["#/scope?names=ur5e.wrist_3.sensed", ["configuration", "device_parameter"], page.locator(".parameters input").first()],
    ["#/devices", ["names"], page.locator('.stage[data-ghost="commanded"]')],
  ] as const) {
    await show(page, "#/log");
    await page.getByRole("main", { name: "Log" }).waitFor();
    if (view === "#/devices") {
      await show(page, view);
      await page.locator('.stage[data-placed="yes"] canvas').waitFor();
    }
    const made = await turnedAway(page, 503, 1, calls);
    if (view === "#/devices") await page.getByRole("combobox", { name: "Ghost" }).selectOption("commanded");
    else await show(page, view);
    await shown.waitFor();
    for (const call of calls) expect(made.get(call), `${view} ${call}`).toBeGreaterThan(1);
    await page.unroute(/\/v1\/call\/\w+$/);
  }
  await context.close();
});

test("a fault of the system is shown, and disappears when the question is answered", async () => {
  const { page, context } = await open(browser, running.url);
  await show(page, "#/log");
  await page.getByRole("main", { name: "Log" }).waitFor();
  const made = await turnedAway(page, 500, 2, ["names"]);
  await show(page, "#/start");
  const told = page.getByRole("region", { name: "Messages" }).getByText("internal error in OpenGPAC");
  await told.waitFor();
  await page.getByRole("button", { name: "Take the tour" }).waitFor();
  await told.waitFor({ state: "detached" });
  expect(made.get("names")).toBeGreaterThanOrEqual(3);
  await context.close();
});
