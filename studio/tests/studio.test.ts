// SPDX-License-Identifier: Apache-2.0
// The page with a running arm: open it, see live values, start a move from the form, halt it.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import {
  axeFindings,
  browse,
  changes,
  command,
  goTo,
  LOOKS,
  type Opened,
  open,
  PATIENCE_MS,
  type Running,
  run,
  shoot,
  show,
} from "./running";

/** Every view, with a selector of its loaded content. */
const VIEWS: [string, string][] = [
  ["System", "table.sources tbody tr"],
  ["Data flow", "[data-box]"],
  ["Verbs", ".list.lit"],
  ["Devices", ".stage canvas"],
  ["Scope", ".screen canvas"],
  ["Log", ".line"],
];

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

test("the token is gone from the address, and the page says which system it shows", async () => {
  expect(studio.page.url()).not.toContain("token");
  expect(await studio.page.getByRole("heading", { level: 1 }).textContent()).toBe("bench");
});

test("values move: SVVs of the arm, firings of the sources, the present command list", async () => {
  const { page } = studio;
  await goTo(page, "Devices");
  const [before, after] = await changes(page, '[data-live="ur5e.shoulder_pan.sensed"]');
  expect(Number(before)).not.toBe(Number(after));
  await goTo(page, "System");
  await changes(page, "table.sources td.number:nth-child(5)");
  await goTo(page, "Verbs");
  await page.locator(".verb-list").getByRole("link", { name: /^sway/ }).click();
  await page.locator('.list.lit[data-list="near"]').waitFor();
  await page.locator('.list.lit[data-list="far"]').waitFor();
  // A straight arrow has no width: for the browser it is attached but not visible.
  await page.locator(".arrow.taken").waitFor({ state: "attached" });
});

test("the arrows of a diagram stay in place while its state changes", async () => {
  const { page } = studio;
  await page.locator('.list.lit[data-list="near"]').waitFor();
  await page.evaluate(() => {
    const counted = window as unknown as { removedArrows: number };
    counted.removedArrows = 0;
    new MutationObserver((changes) => {
      for (const node of changes.flatMap((change) => [...change.removedNodes]))
        if (node instanceof Element && (node.matches(".arrow") || node.querySelector(".arrow"))) counted.removedArrows += 1;
    }).observe(document.querySelector(".picture") as Element, { childList: true, subtree: true });
  });
  await page.locator('.list.lit[data-list="far"]').waitFor();
  await page.locator('.list.lit[data-list="near"]').waitFor();
  expect(await page.evaluate(() => (window as unknown as { removedArrows: number }).removedArrows)).toBe(0);
});

test.each(VIEWS)("the view %s passes the check of axe and fits into the window, wide or narrow, light or dark", async (view, content) => {
  const { page, errors } = studio;
  await goTo(page, view);
  await page.locator(`main ${content}`).first().waitFor();
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    await shoot(page, `${view.toLowerCase().replace(" ", "-")}-${look.width}-${look.scheme}`);
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    expect(wide, `wider than ${look.width} pixels`).toBeLessThanOrEqual(0);
  }
  expect(errors).toEqual([]);
});

const JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"];

/** Selects exactly these joints in the form. */
async function choose(page: Page, joints: string[]): Promise<void> {
  for (const joint of JOINTS) await page.locator("form.start").getByRole("checkbox", { name: joint }).setChecked(joints.includes(joint));
}

test("what the system refuses is shown in its words, at the field that it is about", async () => {
  const { page } = studio;
  await goTo(page, "Verbs");
  await page
    .locator(".verb-list")
    .getByRole("link", { name: /^move_absolute/ })
    .click();
  const form = page.locator("form.start");
  await choose(page, ["wrist_3"]);
  const goal = form.getByRole("group", { name: "goal" });
  await goal.getByLabel("wrist_3").fill("90");
  await form.getByRole("group", { name: "speed" }).getByLabel("wrist_3").fill("0.2");
  const refused = form
    .locator(".input")
    .filter({ has: page.getByRole("group", { name: "goal" }) })
    .getByRole("alert");
  await command(form.getByRole("button", { name: "Start" }), refused);
  await expect.poll(() => refused.textContent()).toMatch(/OutOfRange.*90 rad/);
  expect(await goal.getByLabel("wrist_3").getAttribute("aria-invalid")).toBe("true");
  await page.locator(".bar").getByText("this page").filter({ visible: true }).waitFor();
});

test("a move is started from the form, runs, and is halted", async () => {
  const { page } = studio;
  const form = page.locator("form.start");
  await form.getByRole("group", { name: "goal" }).getByLabel("wrist_3").fill("170 deg");
  const instance = page.locator(".instances li").filter({ hasText: "running" });
  await command(form.getByRole("button", { name: "Start" }), instance);
  await page.locator('.list.lit[data-list="start"]').waitFor();
  const name = (await instance.getByRole("link").textContent()) ?? "";
  await command(instance.getByRole("button", { name: "Halt" }), page.locator(".reports li").filter({ hasText: name }));
  await page.locator(".history").getByText("command list 'stop'").waitFor();
  await page.locator(".instances li").filter({ hasText: name }).getByText("ended").waitFor();
});

test("two that need the same joint: the second is refused, and the holder is named", async () => {
  const { page } = studio;
  await goTo(page, "Verbs");
  await page
    .locator(".verb-list")
    .getByRole("link", { name: /^move_absolute/ })
    .click();
  const form = page.locator("form.start");
  // The earlier input is still there.
  expect(await form.getByRole("group", { name: "speed" }).getByLabel("wrist_3").inputValue()).toBe("0.2");
  await command(form.getByRole("button", { name: "Clear" }), form.locator(".clear:disabled"));
  await choose(page, ["shoulder_pan", "wrist_3"]);
  await form.getByRole("group", { name: "goal" }).getByLabel("shoulder_pan").fill("0");
  await form.getByRole("group", { name: "goal" }).getByLabel("wrist_3").fill("0");
  await command(form.getByRole("button", { name: "Start" }), form.getByRole("alert").getByText(/SecondWriter.*sway/));
});

test("changing inputs begins with the present values, and follows them", async () => {
  const { page } = studio;
  await show(page, "verbs/sway/sway%231");
  const instance = page.locator(".instances > li").filter({ has: page.getByRole("link", { name: "sway#1" }) });
  const field = instance.getByLabel("amplitude");
  await command(instance.getByRole("button", { name: "Change inputs" }), field);
  expect(await field.inputValue()).toBe("0.4");
  const change = instance.getByRole("button", { name: "Change", exact: true });
  expect(await change.isDisabled(), "nothing is changed yet").toBe(true);
  await field.fill("0.3 rad");
  await instance.getByText("now 0.4").waitFor();
  await command(change, instance.getByText("now 0.4"), "detached");
  await expect.poll(() => field.inputValue(), { timeout: PATIENCE_MS }).toBe("0.3");
  await field.fill("2");
  await command(change, instance.getByText("its range is"));
  expect(await field.inputValue(), "what was written stays").toBe("2");
  await command(instance.getByRole("button", { name: "Change inputs" }), field, "detached");
});

test("the log has commands and who gave them, and is filtered", async () => {
  const { page } = studio;
  await goTo(page, "Log");
  await page.getByRole("searchbox", { name: "Text" }).fill("command halt move_absolute");
  await page.locator(".line").filter({ hasText: "by studio-" }).first().click();
  await page.getByRole("heading", { name: /^command of move_absolute/ }).waitFor();
});

test("a joint moves while its button is held, and stands when it is let go", async () => {
  const { page } = studio;
  await goTo(page, "Devices");
  const row = page.locator("tr").filter({ has: page.getByRole("link", { name: "wrist_3" }) });
  await row.getByText("standstill").waitFor();
  const forward = row.getByRole("button", { name: "Jog wrist_3 forward while held" });
  await forward.focus();
  await page.keyboard.down("Space");
  await row.getByText("moving").waitFor();
  await page.keyboard.up("Space");
  await row.getByText("standstill").waitFor();
});

test("the emergency stop ends what moves, says its cause, and is reset", async () => {
  const { page } = studio;
  await page.getByRole("button", { name: "Emergency stop" }).click();
  await page.locator(".stopped").getByText("pressed in the studio").waitFor();
  await goTo(page, "Devices");
  await expect.poll(() => page.locator("table.family").getByText("disabled").count()).toBe(6);
  await command(page.getByRole("button", { name: "Reset" }), page.locator(".stopped"), "detached");
  await command(page.getByRole("button", { name: "Enable all" }), page.locator("table.family:not(:has(tr.old))"));
  await expect.poll(() => page.locator("table.family").getByText("standstill").count()).toBe(6);
});

test("by the keyboard alone: to a view, over the skip button to its content", async () => {
  const { page, context } = await open(browser, running.url);
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  expect(await page.evaluate(() => document.activeElement?.id)).toBe("main");
  await page.getByRole("navigation", { name: "Views" }).getByRole("link", { name: "Log" }).focus();
  await page.keyboard.press("Enter");
  await page.getByRole("main", { name: "Log" }).waitFor();
  await context.close();
});

test("without a token the page says where to get one", async () => {
  const context = await browser.newContext();
  const page = await context.newPage();
  await page.goto(new URL("/", running.url).href);
  await page.getByLabel("Token").fill(running.url);
  await page.getByRole("button", { name: "Open" }).click();
  await page.getByText("live", { exact: true }).waitFor();
  await context.close();
});
