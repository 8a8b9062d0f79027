// SPDX-License-Identifier: Apache-2.0
// A prismatic joint is shown in m and N everywhere, although the same blocks also serve revolute joints.
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { browse, type Opened, open, type Running, run, shoot, show } from "./running";

let running: Running;
let browser: Browser;
let opened: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "sliding.py"), "--role", "configure"), browse(false)]);
  opened = await open(browser, running.url);
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
});

test("no view shows a unit that is a choice, and every port of a sliding joint's servo is in m and N", async () => {
  const { page } = opened;
  for (const view of ["devices", "verbs", "flow"]) {
    await show(page, `#/${view}`);
    const told = () => page.locator("main").textContent();
    await expect.poll(told).toContain("ram");
    expect(await told(), view).not.toMatch(/rad\|m|\|N\b/);
  }
  const boxes = page.locator(".react-flow__node");
  await boxes.first().waitFor();
  const seen: string[] = [];
  for (const id of await boxes.evaluateAll((nodes) => nodes.map((node) => node.getAttribute("data-id") ?? ""))) {
    await page.locator(`.react-flow__node[data-id="${id}"]`).focus();
    await page.keyboard.press("Enter");
    await page.locator(`.react-flow__node.selected[data-id="${id}"]`).waitFor();
    seen.push((await page.locator("main").textContent()) ?? "");
  }
  await shoot(page, "sliding-flow");
  expect(seen.join("\n")).toMatch(/ in m\b/);
  expect(seen.join("\n")).not.toMatch(/\brad\b/);
});
