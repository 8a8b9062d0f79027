// SPDX-License-Identifier: Apache-2.0
// The first minutes with a page: an arm without a line of program, suggestions, help, keys.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Commander } from "./commander";
import { axeFindings, browse, command, goTo, LOOKS, type Opened, open, ROOT, type Running, run, shoot, show, standsStill } from "./running";

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

test("the page opens with what runs and what to try", async () => {
  const { page } = studio;
  await page.getByRole("main", { name: "Start" }).waitFor();
  await page.getByText("6 devices").waitFor();
  await page.getByText(", 6 enabled").waitFor();
  for (const title of ["Jog a joint", "Move to a position", "View the machine", "Watch a value"])
    await page.getByRole("link", { name: title }).waitFor();
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    expect(await axeFindings(page)).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth)).toBe(true);
    await shoot(page, `start-${look.width}-${look.scheme}`);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
});

test("the first view is at most 600 kB, as it is sent", async () => {
  const { page, context } = await open(browser, running.url);
  await page.getByText("6 devices").waitFor();
  const [bytes, shown_ms] = await page.evaluate(() => {
    const sent = [
      ...performance.getEntriesByType("navigation"),
      ...performance.getEntriesByType("resource"),
    ] as PerformanceResourceTiming[];
    return [sent.reduce((sum, one) => sum + one.encodedBodySize, 0), performance.now()] as const;
  });
  process.stdout.write(`first view: ${(bytes / 1000).toFixed(0)} kB, shown after at most ${shown_ms.toFixed(0)} ms\n`);
  expect(bytes).toBeGreaterThan(50_000);
  expect(bytes).toBeLessThanOrEqual(600_000);
  await context.close();
});

test("bars take at most 15 % of the height of a telephone and of a tablet, and what they have unfolds", async () => {
  const { page } = studio;
  for (const [width, height] of [
    [390, 844],
    [412, 915],
    [800, 1000],
  ] as const) {
    await page.setViewportSize({ width, height });
    const begins = (await page.getByRole("main").boundingBox())?.y ?? height;
    expect(begins, `at ${width} by ${height}`).toBeLessThanOrEqual(0.15 * height);
    await page.locator(".summary").getByText("nobody commands", { exact: true }).waitFor();
    expect(await page.getByRole("combobox", { name: "Mode" }).isVisible()).toBe(false);
    await page.getByRole("button", { name: "More: command, mode and clock" }).click();
    await page.getByRole("combobox", { name: "Mode" }).waitFor();
    await page.getByRole("button", { name: "Pause page" }).waitFor();
    expect(await axeFindings(page), `unfolded at ${width}`).toEqual([]);
    await page.getByRole("button", { name: "Less: command, mode and clock" }).click();
    expect(
      await page
        .getByRole("main")
        .boundingBox()
        .then((box) => box?.y),
    ).toBe(begins);
    // If there are more links than fit, the present one is visible.
    await goTo(page, "Workspaces");
    const link = await page.getByRole("navigation", { name: "Views" }).getByRole("link", { name: "Workspaces" }).boundingBox();
    expect((link?.x ?? width) + (link?.width ?? 0)).toBeLessThanOrEqual(width);
    await goTo(page, "Start");
  }
  await page.setViewportSize({ width: 1440, height: 900 });
});

test("what is offered works: a joint is jogged, and the arm moves to a position", async () => {
  const { page } = studio;
  await page.getByRole("link", { name: "Jog a joint" }).click();
  await page.getByRole("main", { name: "Devices" }).waitFor();
  const jog = page.getByRole("button", { name: "Jog wrist_3 forward while held" });
  await jog.waitFor();
  await jog.hover();
  await standsStill(jog);
  await page.mouse.down();
  await expect.poll(async () => Math.abs(await watch.value("ur5e.wrist_3.sensed"))).toBeGreaterThan(0.01);
  await page.mouse.up();
  const jogs = async () => (await watch.instances()).filter((one) => one.verb === "jog").length;
  await expect.poll(jogs).toBe(0);
  await goTo(page, "Start");
  await page.getByRole("link", { name: "Move to a position" }).click();
  const form = page.locator("form.start");
  const goal = form.getByRole("group", { name: "goal" });
  const present = goal.getByRole("button", { name: "Present" });
  await standsStill(present);
  await present.click();
  await expect.poll(() => goal.getByLabel("wrist_3").inputValue()).not.toBe("");
  await goal.getByLabel("wrist_3").fill("-20 deg");
  // The form is longer than the window, but its button is visible.
  const start = form.getByRole("button", { name: "Start" });
  expect(await form.evaluate((one) => one.getBoundingClientRect().bottom > window.innerHeight)).toBe(true);
  const box = await start.boundingBox();
  expect((box?.y ?? Number.POSITIVE_INFINITY) + (box?.height ?? 0)).toBeLessThanOrEqual(900);
  await shoot(page, "start-in-view");
  await command(start, page.locator(".reports li").filter({ hasText: "move_absolute" }).first());
  expect(await watch.value("ur5e.wrist_3.sensed")).toBeCloseTo(-0.349, 2);
});

test("a page of the default role records what it sees, and opens it", async () => {
  const { page } = studio;
  await goTo(page, "Start");
  await page
    .locator(".tries")
    .getByRole("link", { name: /^Record/ })
    .click();
  await page.getByRole("main", { name: "Recordings" }).waitFor();
  await page.getByLabel("File").fill("kept");
  await page.getByRole("button", { name: "Record", exact: true }).click();
  const row = page.locator("tr").filter({ has: page.getByRole("rowheader", { name: "kept.mcap" }) });
  await row.getByText("records", { exact: true }).waitFor();
  await row.getByRole("button", { name: "Stop" }).click();
  await row.getByText("complete").waitFor();
  await row.getByRole("button", { name: "Open" }).click();
  const time = page.getByRole("region", { name: "Time", exact: true });
  await time.getByText("kept.mcap").waitFor();
  await time.getByRole("button", { name: "Live" }).click();
  await page.getByText("The page follows the system").waitFor();
});

test("a relative motion offers no present positions, which it would count twice, and says within which range it ends", async () => {
  const { page } = studio;
  await show(page, "#/verbs/move_relative");
  const form = page.locator("form.start");
  await form
    .getByText(/ends within/)
    .first()
    .waitFor();
  await form
    .getByText(/counted from/)
    .first()
    .waitFor();
  expect(await form.getByRole("button", { name: "Present" }).count()).toBe(0);
  // The same view of an absolute motion offers them.
  await show(page, "#/verbs/move_absolute");
  await form.getByRole("button", { name: "Present" }).waitFor();
});

/** Returns the beginning of the first paragraph of a section of docs/studio.md, up to its first mark. */
function opening(section: string): string {
  const [, text] = readFileSync(join(ROOT, "docs/studio.md"), "utf8").split(`\n## ${section}\n`);
  const words =
    /^[\w*][^`,(]{20,}/m
      .exec(text ?? "")?.[0]
      .replaceAll(/\*\w+\*/g, "")
      .replaceAll("\n", " ")
      .trim() ?? "";
  expect(words.length, `the opening of '${section}'`).toBeGreaterThan(20);
  return words;
}

test("help says what the docs say of each view, and ? lists the keys", async () => {
  const { page, errors } = studio;
  for (const [view, section] of [
    ["Scope", "The scope"],
    ["Data flow", "Data flow, and the editor"],
  ] as const) {
    const says = opening(section);
    await goTo(page, view);
    await page.getByRole("button", { name: "Help", exact: true }).click();
    const help = page.getByRole("dialog", { name: `Help: ${view}` });
    await help.getByText(says).first().waitFor();
    expect(await axeFindings(page)).toEqual([]);
    await help.getByRole("button", { name: "Close" }).click();
    await help.waitFor({ state: "hidden" });
  }
  await show(page, "#/log");
  await page.locator("#main").focus();
  await page.keyboard.press("?");
  const keys = page.getByRole("dialog", { name: "Keys" });
  await keys.getByText("undo, redo").waitFor();
  expect(await axeFindings(page)).toEqual([]);
  await shoot(page, "keys");
  await page.keyboard.press("Escape");
  await keys.waitFor({ state: "hidden" });
  expect(errors).toEqual([]);
});
