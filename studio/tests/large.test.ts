// SPDX-License-Identifier: Apache-2.0
// A verb of 200 blocks, installed and in the editor. For the time the page takes, see faults/.
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { choose, edit, illegible, move, openAnew, openFlow, pan, valuesChange, zoom } from "./large";
import { axeFindings, browse, type Opened, open, type Running, run, shoot } from "./running";

let running: Running;
let browser: Browser;
let opened: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "blocks.py"), "--edit"), browse(false)]);
  opened = await open(browser, running.url);
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
});

test("all 200 blocks are drawn, and the values on their 180 wires change", async () => {
  const { page } = opened;
  await openFlow(page);
  await valuesChange(page);
  await shoot(page, "flow-200-blocks");
});

test.each([1440, 800, 390])("what is seen of 200 blocks at %i pixels can be read", async (width) => {
  const { page } = opened;
  await page.setViewportSize({ width, height: 900 });
  for (const grouping of [null, "By source", "By instance"]) {
    if (grouping) await page.getByRole("button", { name: grouping }).click();
    if (grouping) await page.locator(".region").first().waitFor();
    else await openAnew(page);
    await expect.poll(() => illegible(page)).toEqual([]);
    // The checks of an arm in groups are in flow.test.ts.
    if (grouping === null) expect(await axeFindings(page)).toEqual([]);
    await shoot(page, `flow-200-${width}-${grouping ?? "whole"}`);
    if (grouping) await page.getByRole("button", { name: grouping }).click();
  }
  await page.setViewportSize({ width: 1440, height: 900 });
});

test("the drawing of 200 blocks is zoomed, moved, a block chosen, and its values go on changing", async () => {
  const { page, errors } = opened;
  await zoom(page);
  await pan(page);
  await choose(page, "gain07_4");
  const value = page.locator('.side [data-live="many#1:value07_4"]');
  await expect.poll(() => value.textContent()).not.toBe("–");
  const before = await value.textContent();
  await expect.poll(() => value.textContent()).not.toBe(before);
  await valuesChange(page);
  expect(errors).toEqual([]);
});

test("200 blocks are edited: opened from the system, laid out, checked, one moved and one renamed", async () => {
  const { page, errors } = opened;
  await edit(page);
  await expect.poll(() => illegible(page)).toEqual([]);
  await move(page, "gain07_4");
  await page.getByLabel("Label").fill("other");
  await page.getByLabel("Label").press("Enter");
  await page.locator('[data-box="other"]').waitFor();
  await page.getByText("all passed").waitFor();
  await page.getByRole("button", { name: "Undo" }).click();
  await page.locator('[data-box="gain07_4"]').waitFor();
  await shoot(page, "edit-200-blocks");
  expect(errors).toEqual([]);
});
