// SPDX-License-Identifier: Apache-2.0
// Jogging the tool of an arm: held and by steps, in the axes of the base and of the tool; the tool stops if the page's link is lost.
import { join } from "node:path";
import type { Browser, Locator, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import type { ArmDescription } from "../src/control/shapes";
import { toolPose } from "../src/views/devices/toolPose";
import { Commander } from "./commander";
import { Link } from "./link";
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

/**
 * Time after the last heartbeat of a page, on the system's clock, within which a jog has begun to stop, ms; the next constant is the
 * time by which its tool stands still.
 */
const SILENT_MS = 250;
const STANDS_MS = 1000;

let running: Running;
let browser: Browser;
let link: Link;
let operator: Opened;
let watch: Commander;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "bare_arm.py"), "--role", "configure"), browse(false)]);
  const url = new URL(running.url);
  link = await Link.to(Number(url.port));
  url.port = String(link.port);
  watch = await Commander.look(running.url);
  operator = await open(browser, url.href);
  await goTo(operator.page, "Devices");
});

afterEach(() => {
  link.thaw();
  link.mend();
  link.hold(false);
});

afterAll(async () => {
  await watch?.close();
  await browser?.close();
  link?.close();
  await running?.stop();
});

const panel = (page: Page) => page.getByRole("region", { name: /^Tool of ur5e/ });
const told = (page: Page) => panel(page).getByRole("status");
const jogs = async () => (await watch.instances()).filter((one) => one.verb === "jog_linear" && one.state !== "created").length;

/** Returns a figure of the displayed pose, mm or degrees; NaN if the page shows none. */
async function figure(page: Page, axis: string): Promise<number> {
  return Number.parseFloat((await panel(page).locator(`[data-pose="${axis}"]`).textContent()) ?? "");
}

/**
 * Presses and holds a control that stands still, as a person does; repeats it if the page reports that something else was there before.
 */
async function hold(page: Page, button: Locator): Promise<void> {
  const again = page.getByText(/Press again/);
  for (;;) {
    await again.waitFor({ state: "hidden" });
    await button.scrollIntoViewIfNeeded();
    await standsStill(button);
    await button.hover();
    await page.mouse.down();
    await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
    if (!(await again.isVisible())) return;
    await page.mouse.up();
  }
}

async function press(page: Page, name: string): Promise<void> {
  await hold(page, panel(page).getByRole("button", { name, exact: true }));
}

/** Makes one step, and returns the change of a figure. Repeats a step that the page cut short, as on a busy machine. */
async function step(page: Page, name: string, axis: string): Promise<number> {
  for (;;) {
    const before = await figure(page, axis);
    await press(page, name);
    await page.mouse.up();
    const said = async () => [await told(page).textContent(), ...(await panel(page).getByRole("alert").allTextContents())].join(" ");
    await expect.poll(said).toMatch(/Step completed|received nothing from this page|after it was issued/);
    await expect.poll(jogs).toBe(0);
    if (!(await said()).includes("Step completed.")) continue;
    // The figures are updated ten times a second.
    const ended_ms = await watch.now_ms();
    await expect.poll(async () => (await watch.now_ms()) - ended_ms).toBeGreaterThan(500);
    return (await figure(page, axis)) - before;
  }
}

async function choose(page: Page, of: string, value: string): Promise<void> {
  await panel(page).getByRole("group", { name: of }).getByText(value, { exact: true }).click();
}

/** Runs in the page: returns the elements beyond the right edge of a panel. */
function beyond(of: Element): string[] {
  const edge = of.getBoundingClientRect().right;
  const inside = [...of.querySelectorAll("button, label, input, dd")];
  return inside.filter((one) => one.getBoundingClientRect().right > edge).map((one) => one.textContent ?? "");
}

test("without a line of code the pose of the tool stands there in mm and degrees", async () => {
  const { page } = operator;
  await expect.poll(() => figure(page, "X")).not.toBeNaN();
  const [arm] = await watch.call<ArmDescription[]>("arms", {});
  if (!arm?.chain) throw new Error("the system has no arm whose geometry it knows");
  const q = await Promise.all(arm.joints.map((joint) => watch.value(`${joint}.sensed`)));
  const { place } = toolPose(arm.chain, q);
  for (const [index, axis] of ["X", "Y", "Z"].entries()) expect(await figure(page, axis), axis).toBeCloseTo(1000 * (place[index] ?? 0), 0);
  await told(page).getByText("The tool is at rest.").waitFor();
});

test("the tool moves along an axis while its button is held, and stands when it is let go", async () => {
  const { page } = operator;
  const before = await figure(page, "Z");
  const isDown = async () => before - (await figure(page, "Z")) > 5;
  // Again where a busy machine let the jog end, since the page was not heard for 0.25 s.
  let isTold = false;
  while (!(await isDown())) {
    const starts = await watch.starts();
    await press(page, "Jog the tool along −Z while held");
    await expect.poll(async () => (await watch.starts()) > starts || (await panel(page).getByRole("alert").first().isVisible())).toBe(true);
    const isOver = async () => {
      isTold ||= await told(page).getByText("The tool moves while the button is held.").isVisible();
      return (await isDown()) || (await jogs()) === 0;
    };
    await expect.poll(isOver).toBe(true);
    await page.mouse.up();
    await expect.poll(jogs).toBe(0);
  }
  await expect.poll(jogs).toBe(0);
  expect(isTold).toBe(true);
  await told(page).getByText("The tool is at rest.").waitFor();
  const stands = await figure(page, "Z");
  const at = await watch.now_ms();
  await expect.poll(async () => (await watch.now_ms()) - at).toBeGreaterThan(STANDS_MS);
  expect(await figure(page, "Z")).toBeCloseTo(stands, 0);
});

test("a press of another button jogs at once, though the focus leaves the one before", async () => {
  const { page } = operator;
  for (const name of ["wrist_2", "wrist_3"]) {
    const before = await watch.starts();
    const button = page.getByRole("button", { name: `Jog ${name} forward while held` });
    await hold(page, button);
    await expect.poll(() => watch.starts()).toBe(before + 1);
    await page.mouse.up();
    await expect.poll(async () => (await watch.instances()).filter((one) => one.verb === "jog").length).toBe(0);
  }
});

test("a press that follows a release at once jogs: it waits for its own halt", async () => {
  const { page } = operator;
  const before = await watch.starts();
  await press(page, "Jog the tool about +Z while held");
  await expect.poll(() => watch.starts()).toBe(before + 1);
  await page.mouse.up();
  await page.mouse.down();
  await expect.poll(() => watch.starts()).toBe(before + 2);
  await page.mouse.up();
  await expect.poll(jogs).toBe(0);
});

test("one press is one step of the length that is chosen, along the axes of the base or of the tool", async () => {
  const { page } = operator;
  await choose(page, "Moves", "10");
  expect(await step(page, "Step the tool along +X by 10 mm", "X")).toBeCloseTo(10, 0);
  await choose(page, "Axes of", "tool");
  // The tool of this arm points down: forward along its axis is down.
  expect(await step(page, "Step the tool along +Z by 10 mm", "Z")).toBeCloseTo(-10, 0);
  await choose(page, "Axes of", "base");
  expect(Math.round((await step(page, "Step the tool about +Z by 10 degrees", "RZ")) + 360) % 360).toBe(10);
  await choose(page, "Moves", "0.1");
  expect(await step(page, "Step the tool along −Y by 0.1 mm", "Y")).toBeCloseTo(-0.1, 1);
  await choose(page, "Moves", "while held");
});

test("a link that is lost ends the jog within the time that the verb declares", async () => {
  const { page } = operator;
  const moving = () => watch.value("ur5e.shoulder_lift.commanded");
  await press(page, "Jog the tool along +Z while held");
  await expect.poll(jogs).toBe(1);
  const begun = await moving();
  await expect.poll(async () => Math.abs((await moving()) - begun)).toBeGreaterThan(1e-4);
  link.freeze();
  const cut_ms = await watch.now_ms();
  await expect.poll(async () => (await watch.now_ms()) - cut_ms).toBeGreaterThan(SILENT_MS + STANDS_MS);
  const stands = await moving();
  const at = await watch.now_ms();
  await expect.poll(async () => (await watch.now_ms()) - at).toBeGreaterThan(STANDS_MS);
  expect(await moving()).toBe(stands);
  link.thaw();
  await page.mouse.up();
  await page.getByText("live", { exact: true }).waitFor();
  await expect.poll(jogs).toBe(0);
});

test("another session's heartbeat does not keep the jog of a page going that has fallen silent", async () => {
  const { page } = operator;
  await press(page, "Jog the tool along +Z while held");
  await expect.poll(jogs).toBe(1);
  link.freeze();
  // As a second page does that takes command and holds a button of its own.
  const other = await Commander.open(running.url, true);
  const state = async () => (await watch.instances()).find((one) => one.verb === "jog_linear" && one.state !== "created")?.state;
  const until_ms = (await watch.now_ms()) + SILENT_MS + STANDS_MS;
  for (let beat = 0; (await watch.now_ms()) < until_ms; beat++)
    await other.call("write", { name: "studio.heartbeat", value: 2 ** 20 + beat });
  expect(await state()).not.toBe("running");
  await other.close();
  link.thaw();
  await page.mouse.up();
  await page.getByText("live", { exact: true }).waitFor();
  await expect.poll(jogs).toBe(0);
});

test("a step that is held up moves nothing when the network goes on", async () => {
  const { page } = operator;
  await choose(page, "Moves", "10");
  const before = await watch.value("ur5e.shoulder_lift.commanded");
  link.hold(true);
  await press(page, "Step the tool along +Z by 10 mm");
  await page.mouse.up();
  await expect.poll(() => link.held).toBeGreaterThan(0);
  const at = await watch.now_ms();
  await expect.poll(async () => (await watch.now_ms()) - at).toBeGreaterThan(1000);
  link.hold(false);
  await panel(page)
    .getByRole("alert")
    .getByText(/after it was issued/)
    .waitFor();
  expect(await watch.value("ur5e.shoulder_lift.commanded")).toBe(before);
  // The instance is there: the next press is the step.
  expect(await step(page, "Step the tool along +Z by 10 mm", "Z")).toBeCloseTo(10, 0);
  await choose(page, "Moves", "while held");
});

test("who commands is asked: another session's command is not taken", async () => {
  const { page } = operator;
  const other = await Commander.open(running.url, false).catch(() => null);
  // The page has commanded since its first press: command is not taken implicitly.
  expect(other).toBe(null);
  await press(page, "Jog the tool along +Y while held");
  await expect.poll(jogs).toBe(1);
  await page.mouse.up();
  await expect.poll(jogs).toBe(0);
});

test("the page refuses nothing that moved: the panel stands still, whatever it tells, and axe finds nothing", async () => {
  const { page, errors } = operator;
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    await panel(page).scrollIntoViewIfNeeded();
    const place = async () =>
      JSON.stringify(await panel(page).getByRole("button", { name: "Jog the tool about +Z while held" }).boundingBox());
    await standsStill(panel(page));
    const before = await place();
    const height = (await panel(page).boundingBox())?.height;
    await press(page, "Jog the tool along +X while held");
    await told(page).getByText("The tool moves while the button is held.").waitFor();
    expect(await place()).toBe(before);
    await shoot(page, `tool-${look.width}-${look.scheme}`);
    await page.mouse.up();
    await expect.poll(jogs).toBe(0);
    expect((await panel(page).boundingBox())?.height).toBe(height);
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth)).toBe(true);
    expect(await panel(page).evaluate(beyond), `at ${look.width}`).toEqual([]);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  expect(await stopRectangles(page)).toEqual([STOP]);
  expect(errors).toEqual([]);
});

test("of joints that nobody reads the pose is grey with its age, and a press says what to do", async () => {
  const { page } = operator;
  await command(page.getByRole("button", { name: "Disable all" }), page.locator(".tool.old"));
  await expect.poll(() => page.locator("table.family").getByText("disabled").count()).toBe(6);
  await panel(page).locator(".age").getByText("old").waitFor();
  await told(page).getByText("Enable the joints of the arm first.").waitFor();
  expect(
    await panel(page)
      .locator('[data-pose="X"]')
      .evaluate((one) => getComputedStyle(one).fontStyle),
  ).toBe("italic");
  await press(page, "Jog the tool along +X while held");
  await panel(page).getByRole("alert").getByText("6 joints of this arm are not enabled, so nothing has moved.").waitFor();
  await page.mouse.up();
  await shoot(page, "tool-refused");
});
