// SPDX-License-Identifier: Apache-2.0
// Two people at one system: command, individual alarms, shared workspaces, and the operator's panel on a tablet.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Commander } from "./commander";
import {
  axeFindings,
  browse,
  command,
  goTo,
  type Opened,
  open,
  PANEL_STOPS,
  type Running,
  run,
  STOP,
  shoot,
  show,
  stopRectangles,
} from "./running";

let running: Running;
let browser: Browser;
let anna: Opened;
let bert: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "people.py"), "--role", "configure"), browse(false)]);
  [anna, bert] = await Promise.all([open(browser, running.url), open(browser, running.url)]);
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
});

const button = (page: Page, label: string) => page.locator(`[data-button="${label}"]`);

test("the operator's panel of a program fits a tablet, is touched with a finger, and starts what it names and nothing else", async () => {
  const { page } = anna;
  await show(page, "#/panel/joint");
  await page.getByRole("button", { name: "Reach out", exact: true }).waitFor();
  expect(await page.locator("[data-button] .start").allTextContents()).toEqual(["Home", "Reach out", "Sway"]);
  expect(await page.getByRole("navigation").count()).toBe(0);
  expect(await page.getByRole("link").allTextContents(), "it leads nowhere else").toEqual(["Close panel"]);
  // The emergency stop begins at its usual place, and is the largest control.
  for (const width of [360, 390, 600, 800, 1000, 1024, 1280, 1440, 1920]) {
    await page.setViewportSize({ width, height: 900 });
    const [stop, ...others] = await page.evaluate(() =>
      [...document.querySelectorAll<HTMLElement>("button.stop, button:not(.stop, .skip), select, a")]
        .map((one) => ({ isStop: one.classList.contains("stop"), text: one.textContent, box: one.getBoundingClientRect() }))
        .map(({ isStop, text, box }) => ({
          isStop,
          text,
          x: box.x,
          y: box.y,
          right: box.right,
          bottom: box.bottom,
          area: box.width * box.height,
        }))
        .sort((a, b) => Number(b.isStop) - Number(a.isStop)),
    );
    if (!stop) throw new Error("there is no emergency stop");
    expect([stop.x, stop.y], `at ${width}`).toEqual([8, 4]);
    expect(others.length).toBeGreaterThan(5);
    expect(
      others.filter((one) => one.area >= stop.area).map((one) => one.text),
      `larger than the stop at ${width}`,
    ).toEqual([]);
    const under = others.filter(
      (one) => one.x < stop.right && one.y < stop.bottom && one.right > stop.x && one.bottom > stop.y && one.area > 0,
    );
    expect(
      under.map((one) => one.text),
      `under the stop at ${width}`,
    ).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)).toBe(0);
  }
  for (const [width, height] of [
    [800, 1280],
    [1024, 768],
    [390, 844],
  ] as const) {
    await page.setViewportSize({ width, height });
    const small = await page.evaluate(() =>
      [...document.querySelectorAll<HTMLElement>("button, select, input, .operator a")]
        .filter((one) => one.offsetParent !== null || getComputedStyle(one).position === "fixed")
        .filter((one) => !one.classList.contains("skip"))
        .map((one) => ({ text: one.textContent, box: one.getBoundingClientRect() }))
        .filter(({ box }) => box.width < 44 || box.height < 44)
        .map(({ text, box }) => `${text} ${box.width}×${box.height}`),
    );
    expect(small, `touched at ${width}`).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)).toBe(0);
    expect(await axeFindings(page), `${width}`).toEqual([]);
    await shoot(page, `panel-${width}`);
  }
  await page.setViewportSize({ width: 1024, height: 768 });
  await command(button(page, "Reach out").locator(".start"), button(page, "Reach out").getByText("ended: arrived"));
  await expect.poll(() => page.locator('[data-live="elbow.sensed"]').textContent()).toMatch(/^1\.(19|2)/);
  await command(button(page, "Sway").locator(".start"), button(page, "Sway").getByText(/^running: /));
  expect(await button(page, "Sway").getByRole("button", { name: "Sway", exact: true }).isDisabled()).toBe(true);
});

test("a panel leads back from an emergency stop: reset, enable, and its own button goes home", async () => {
  const { page } = anna;
  await show(page, "#/panel/joint");
  await page.setViewportSize({ width: 1440, height: 900 });
  const recovery = page.getByRole("region", { name: "Recovery" });
  await recovery.getByText("Ready").waitFor();
  const home = await button(page, "Home").boundingBox();
  await page.getByRole("button", { name: "Emergency stop" }).click();
  await recovery.getByText("Stopped.").waitFor();
  await button(page, "Home").getByText("emergency stop").waitFor();
  expect(await page.getByRole("button", { name: "Home", exact: true }).isDisabled()).toBe(true);
  for (const width of [1440, 800, 390]) {
    await page.setViewportSize({ width, height: 900 });
    await shoot(page, `panel-stopped-${width}`);
    expect(await axeFindings(page), `${width}`).toEqual([]);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  expect(await button(page, "Home").boundingBox(), "nothing has moved").toEqual(home);
  await command(recovery.getByRole("button", { name: "Reset the stop" }), recovery.getByText("Enable them"));
  await page.locator('[data-value="elbow.sensed"].old').getByText(/old$/).waitFor();
  await command(recovery.getByRole("button", { name: "Enable the drives" }), recovery.getByText("Ready"));
  await page.locator('[data-value="elbow.sensed"]:not(.old)').waitFor();
  await command(page.getByRole("button", { name: "Home", exact: true }), button(page, "Home").getByText(/running|ended: arrived/));
  await button(page, "Home")
    .getByText(/^ended/)
    .waitFor();
  const acknowledge = page.getByRole("button", { name: /^Acknowledge emergency_stop/ }).first();
  await command(acknowledge, acknowledge, "detached");
  // State left by the previous test.
  await command(page.getByRole("button", { name: "Sway", exact: true }), button(page, "Sway").getByText(/^running/));
  await page.setViewportSize({ width: 1024, height: 768 });
});

test("command is asked for by name, declined with a reason, handed over; stopping needs none of it", async () => {
  const { page: holder } = anna;
  const { page: other } = bert;
  const ask = async (reason: string) => {
    const form = other.getByRole("form", { name: "Request command" });
    await command(other.getByRole("button", { name: "Request command" }), form);
    await form.getByLabel("Your name").fill("Bert");
    await form.getByLabel("Reason").fill(reason);
    await command(form.getByRole("button", { name: "Send" }), other.getByText("to hand over command…"));
  };
  await ask("shift change");
  const asked = holder.getByRole("alert").filter({ hasText: "Bert" });
  await asked.getByText("requests command: shift change").waitFor();
  expect(await stopRectangles(holder), "somebody asks").toEqual(PANEL_STOPS);
  expect(await stopRectangles(other), "it waits").toEqual([STOP]);
  expect(await axeFindings(holder)).toEqual([]);
  expect(await axeFindings(other)).toEqual([]);
  // A session that waits for command can still stop.
  await show(other, "#/panel/joint");
  await command(other.getByRole("button", { name: "Halt Sway" }), button(other, "Sway").getByText("ended: halted"));
  await asked.getByLabel(/^Reason for declining/).fill("in a minute");
  const declined = other.getByText(/The request for command was declined by studio-\w+: in a minute\./);
  await command(asked.getByRole("button", { name: "Decline" }), declined);
  await ask("");
  await command(asked.getByRole("button", { name: "Hand over" }), asked, "detached");
  await other.locator(".holder").getByText("this page").waitFor();
  await holder.locator(".holder").getByText("Bert", { exact: true }).waitFor();
  expect(await other.getByRole("button", { name: "Request command" }).count()).toBe(0);
});

test("each alarm is seen with its severity and state in every view, and acknowledged alone", async () => {
  const { page } = bert;
  const other = await Commander.open(running.url, true);
  await other.call("define_alarm", { code: "E102", text: "the brake is worn", remedy: "", severity: "critical" });
  for (const code of ["E101", "E102"]) await other.call("raise_alarm", { code, source: "elbow" });
  const bar = page.getByRole("region", { name: "Alarm bar" });
  await other.giveBack();
  await show(page, "#/log");
  for (const view of ["Scope", "Workspaces"]) {
    await goTo(page, view);
    await bar.getByText("the brake is worn").waitFor();
    expect(await bar.locator(".alarm .tag").allTextContents()).toEqual(["critical", "active"]);
  }
  await bar.getByRole("button", { name: "All 2 alarms" }).click();
  expect(await stopRectangles(page), "the list of alarms is open").toEqual([STOP]);
  expect(await axeFindings(page)).toEqual([]);
  const grease = bar.locator('[data-alarm="E101"]');
  const acknowledged = bar.locator('[data-alarm="E102"] .tag').getByText("acknowledged");
  await command(bar.getByRole("button", { name: "Acknowledge E102 of elbow" }), acknowledged);
  await expect.poll(() => bar.locator('[data-alarm="E102"] .tag').allTextContents()).toEqual(["critical", "acknowledged"]);
  expect(await grease.locator(".tag").allTextContents()).toEqual(["low", "active"]);
  await other.take();
  await other.call("clear_alarm", { code: "E101" });
  await expect.poll(() => grease.locator(".tag").allTextContents()).toEqual(["low", "returned"]);
  await other.call("clear_alarm", { code: "E102" });
  await other.call("acknowledge_alarms", {});
  await bar.waitFor({ state: "detached" });
  await other.close();
});

test("an alarm is shelved with a reason and a time, is told of, and comes back", async () => {
  const { page } = bert;
  const other = await Commander.open(running.url, true);
  for (const code of ["E101", "E102"]) await other.call("raise_alarm", { code, source: "elbow" });
  await other.giveBack();
  await show(page, "#/system");
  const list = page.locator("main");
  await list.locator('[data-alarm="E102"]').waitFor();
  expect(await list.getByRole("button", { name: "Shelve E102" }).count(), "what is critical stays").toBe(0);
  const form = list.getByRole("form", { name: "Shelve E101 of elbow" });
  await command(list.getByRole("button", { name: "Shelve E101 of elbow…" }), form);
  expect(await form.getByRole("button", { name: "Shelve", exact: true }).isDisabled(), "without a reason").toBe(true);
  await form.getByLabel("Reason").fill("the grease comes on Monday");
  await form.getByLabel("for").selectOption("15 min");
  const shelved = list.locator('[data-shelved="E101"]');
  await command(form.getByRole("button", { name: "Shelve", exact: true }), shelved.getByText("the grease comes on Monday"));
  await shelved.getByText(/1[45] min left/).waitFor();
  expect(await list.locator('[data-alarm="E101"]').count()).toBe(0);
  expect(await axeFindings(page)).toEqual([]);
  await shoot(page, "alarm-shelved");
  await other.take();
  await other.call("clear_alarm", { code: "E102" });
  await other.call("acknowledge_alarms", {});
  // No other alarm is raised: the message area states that one is shelved, with a link to it.
  await page.getByRole("link", { name: "1 alarm is shelved" }).waitFor();
  await command(shelved.getByRole("button", { name: "Unshelve E101 of elbow" }), list.locator('[data-alarm="E101"]'));
  const { current } = await other.call<{ current: { shelvings: { who: string; reason: string; ended_by: string }[] }[] }>("alarms", {});
  const [shelving] = current[0]?.shelvings ?? [];
  expect(shelving?.reason).toBe("the grease comes on Monday");
  for (const who of [shelving?.who, shelving?.ended_by]) expect(who, "the system knows who it was").toMatch(/^studio-\w+/);
  await other.call("clear_alarm", { code: "E101" });
  await other.call("acknowledge_alarms", {});
  await other.close();
});

/** Fills the form of a new panel. */
async function write(page: Page, kind: string, fill: (form: ReturnType<Page["getByRole"]>) => Promise<void>): Promise<void> {
  const form = page.getByRole("form", { name: "New panel" });
  await form.getByLabel("Shows").selectOption(kind);
  await fill(form);
  await form.getByRole("button", { name: "Add" }).click();
  await form.waitFor({ state: "detached" });
}

/** Returns the bounding box of a panel, found by its heading. */
async function place(page: Page, heading: string) {
  const box = await page
    .locator(".docked")
    .filter({ has: page.getByRole("tab", { name: heading }) })
    .boundingBox();
  if (!box) throw new Error(`there is no panel '${heading}'`);
  return box;
}

test("a workspace is composed with the mouse and the keyboard, kept, and seen by another person; it is a file", async () => {
  const { page, errors } = bert;
  await show(page, "#/workspaces");
  await page.getByLabel("Name of a new workspace").fill("mine");
  await page.getByRole("button", { name: "Create" }).click();
  await page.getByRole("button", { name: "Add panel" }).click();
  await write(page, "values", async (form) => {
    await form.getByLabel("Heading").fill("Elbow");
    await form.getByLabel(/^SVVs/).fill("elbow.sensed | Position | -9 | -8");
  });
  await page.getByLabel("Split beside Elbow").selectOption("right");
  await write(page, "plot", async (form) => {
    await form.getByLabel("Heading").fill("Curve");
    await form.getByLabel(/^SVVs/).fill("elbow.sensed");
  });
  await page.locator('[data-value="elbow.sensed"]').getByText("above -8").waitFor();
  await page.getByLabel("Split beside Curve").selectOption("bottom");
  await write(page, "verb", async (form) => {
    await form.getByRole("combobox", { name: "Verb" }).fill("sway");
  });
  await page
    .getByRole("group", { name: /State diagram/ })
    .locator(".react-flow__node")
    .first()
    .waitFor();
  // With the keyboard: the divider between two panels, and the position of a panel.
  const before = await place(page, "Elbow");
  await page.getByRole("separator", { name: "Width of the panels beside it" }).press("ArrowRight");
  await expect.poll(async () => (await place(page, "Elbow")).width).toBeGreaterThan(before.width + 5);
  await page.getByLabel("Move Verb sway", { exact: true }).selectOption({ label: "to its left edge" });
  await expect.poll(async () => (await place(page, "Verb sway")).x).toBeLessThan((await place(page, "Elbow")).x);
  // With the mouse: dragged by its heading to the lower side of another panel.
  const target = await place(page, "Curve");
  await page.getByRole("tab", { name: "Verb sway" }).hover();
  await page.mouse.down();
  await page.mouse.move(target.x + target.width / 2, target.y + target.height / 2, { steps: 5 });
  await page.mouse.move(target.x + target.width / 2, target.y + target.height * 0.8, { steps: 5 });
  await page.mouse.up();
  await expect.poll(async () => (await place(page, "Verb sway")).y).toBeGreaterThan((await place(page, "Curve")).y + 40);
  expect(await axeFindings(page)).toEqual([]);
  expect(await stopRectangles(page), "a workspace is composed").toEqual([STOP]);
  await shoot(page, "workspace");
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByText("not saved yet").waitFor({ state: "detached" });
  await page.getByRole("tab", { name: "Curve" }).waitFor();
  const download = page.waitForEvent("download");
  await page.getByRole("button", { name: "Export" }).click();
  const file = JSON.parse(readFileSync(await (await download).path(), "utf8"));
  expect(file).toMatchObject({
    workspace: 1,
    name: "mine",
    layout: { row: [{ panel: "values", title: "Elbow" }, { column: [{ panel: "plot" }, { panel: "verb" }] }] },
  });

  // A different person may not change a workspace that a program has shipped.
  await show(anna.page, "#/workspaces/mine");
  await anna.page.getByRole("tab", { name: "Curve" }).waitFor();
  await anna.page.setViewportSize({ width: 390, height: 844 });
  await anna.page.getByRole("heading", { name: "Curve" }).waitFor();
  expect(await axeFindings(anna.page), "390").toEqual([]);
  await anna.page.setViewportSize({ width: 1440, height: 900 });
  await show(anna.page, "#/workspaces/joint");
  await anna.page.getByLabel("Save under another name").waitFor();
  expect(await anna.page.getByRole("button", { name: "Save", exact: true }).count()).toBe(0);

  // Removed, and forgotten.
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.getByRole("button", { name: "Remove Verb sway" }).click();
  await page.getByRole("tab", { name: "Verb sway" }).waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Discard changes" }).click();
  await page.getByRole("tab", { name: "Verb sway" }).waitFor();
  await page.getByRole("button", { name: "Delete" }).click();
  await page.getByRole("link", { name: "mine" }).waitFor({ state: "detached" });
  expect(errors).toEqual([]);
  expect(anna.errors).toEqual([]);
});
