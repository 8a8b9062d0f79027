// SPDX-License-Identifier: Apache-2.0
// Actions of a user on a data flow of 200 blocks (blocks.py): viewing the whole, zooming, panning, selecting a block.
import type { Page } from "playwright-core";
import { expect } from "vitest";
import { goTo } from "./running";

export const BOXES = 200;
/** Number of wires, each with its own value. */
export const WIRES = 180;

/** Opens the data flow, and waits until it is complete. */
export async function openFlow(page: Page): Promise<void> {
  await goTo(page, "Data flow");
  await drawnAll(page);
  await page.waitForFunction((wires) => document.querySelectorAll(".wire-label [data-live]").length === wires, WIRES);
}

export async function drawnAll(page: Page): Promise<void> {
  await page.waitForFunction((boxes) => document.querySelectorAll("[data-box]").length === boxes, BOXES);
}

/** Reopens the data flow in the window's present size. */
export async function openAnew(page: Page): Promise<void> {
  await goTo(page, "Log");
  await openFlow(page);
}

/** Minimum height of text on the screen, px. */
const LETTERS_PX = 9;

/** Returns the titles of visible boxes that cannot be read, because the text is too small or cut off. Reports it if no box is visible. */
export async function illegible(page: Page): Promise<string[]> {
  return await page.evaluate((least) => {
    const ground = document.querySelector(".canvas")?.getBoundingClientRect();
    const heads = [...document.querySelectorAll<HTMLElement>(".box-head > strong")].filter((one) => {
      const { x, y } = one.getBoundingClientRect();
      return ground && x > ground.x && x < ground.right - 20 && y > ground.y && y < ground.bottom - 10;
    });
    const scale = new DOMMatrix(getComputedStyle(document.querySelector(".react-flow__viewport") as Element).transform).a;
    const found = heads.flatMap((one) => {
      const px = Number.parseFloat(getComputedStyle(one).fontSize) * scale;
      const box = (one.closest(".box") as Element).getBoundingClientRect();
      const own = one.getBoundingClientRect();
      const isCut = one.scrollWidth > one.clientWidth + 1 || one.scrollHeight > one.clientHeight + 1 || own.height > box.height + 2;
      return px < least || isCut ? [`${one.textContent}: ${px.toFixed(1)} px${isCut ? ", cut" : ""}`] : [];
    });
    return heads.length === 0 ? ["no box is in sight"] : found;
  }, LETTERS_PX);
}

/** Waits until every value on a wire has changed. */
export async function valuesChange(page: Page): Promise<void> {
  const shown = () => [...document.querySelectorAll(".wire-label [data-live]")].map((one) => one.textContent);
  await page.waitForFunction(() => [...document.querySelectorAll(".wire-label [data-live]")].every((one) => one.textContent !== "–"));
  const before = await page.evaluate(shown);
  expect(before).toHaveLength(WIRES);
  await page.waitForFunction(
    (was) => [...document.querySelectorAll(".wire-label [data-live]")].every((one, index) => one.textContent !== was[index]),
    before,
  );
}

/** Returns the translation and the scale of the drawing. */
async function view(page: Page): Promise<{ x: number; y: number; scale: number }> {
  return await page.evaluate(() => {
    const { m41, m42, a } = new DOMMatrix(getComputedStyle(document.querySelector(".react-flow__viewport") as Element).transform);
    return { x: m41, y: m42, scale: a };
  });
}

/** Zooms in and out with the wheel. */
export async function zoom(page: Page): Promise<void> {
  const before = await view(page);
  await page.locator(".canvas").hover();
  for (let turn = 0; turn < 10; turn += 1) await page.mouse.wheel(0, -60);
  await expect.poll(async () => (await view(page)).scale).toBeGreaterThan(before.scale * 1.5);
  await page.getByRole("button", { name: "Fit View" }).click();
  await drawnAll(page);
}

/** Drags the background. */
export async function pan(page: Page): Promise<void> {
  const before = await view(page);
  const ground = await page.locator(".canvas").boundingBox();
  if (!ground) throw new Error("there is no drawing");
  const at = { x: ground.x + 4, y: ground.y + 4 };
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x + 120, at.y + 60, { steps: 20 });
  await page.mouse.up();
  await expect
    .poll(async () => {
      const { x, y, scale } = await view(page);
      return [Math.round(x - before.x), Math.round(y - before.y), scale];
    })
    .toEqual([120, 60, before.scale]);
}

/** Selects an installed block: the side panel shows it, with changing values. */
export async function choose(page: Page, block: string): Promise<void> {
  await page.locator(`[data-box="${block}"]`).click();
  await page
    .locator(".side")
    .getByRole("heading", { name: `many#1 · ${block}` })
    .waitFor();
}

/** Opens the verb in the editor. */
export async function edit(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.getByLabel("Open a verb of the system").focus();
  await page.getByLabel("Open a verb of the system").selectOption("many");
  await drawnAll(page);
  await page.getByText("all passed").waitFor();
}

/** Drags a block in the editor. */
export async function move(page: Page, block: string): Promise<void> {
  const box = page.locator(`[data-box="${block}"]`);
  const before = await box.boundingBox();
  if (!before) throw new Error(`${block} is not to be seen`);
  const at = { x: before.x + before.width / 2, y: before.y + 3 };
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x + 60, at.y + 30, { steps: 20 });
  await page.mouse.up();
  await expect.poll(async () => Math.round(((await box.boundingBox())?.x ?? 0) - before.x)).toBeGreaterThan(40);
}
