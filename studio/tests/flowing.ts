// SPDX-License-Identifier: Apache-2.0
// Actions of a user in the data flow: naming, choosing a block, drawing a wire with the mouse or the keyboard.
import type { Page } from "playwright-core";

/** Draws a wire with the keyboard, to a port that the system offers. */
export async function wired(page: Page, field: string, other: string): Promise<void> {
  const choice = page.getByLabel(field, { exact: true });
  await choice.focus();
  await choice.locator("option", { hasText: other }).first().waitFor({ state: "attached" });
  await choice.selectOption(other);
}

export async function named(page: Page, label: string, text: string): Promise<void> {
  const field = page.getByLabel(label, { exact: true });
  await field.fill(text);
  await field.press("Enter");
}

/** Draws a wire from one port to another with the mouse. */
export async function wire(page: Page, from: string, to: string): Promise<void> {
  const [begin, end] = await Promise.all([middle(page, from), middle(page, to)]);
  const answered = page.waitForResponse((response) => response.url().endsWith("/v1/call/compatible"));
  await page.mouse.move(begin.x, begin.y);
  await page.mouse.down();
  await page.mouse.move(begin.x + 15, begin.y + 5);
  await answered;
  await page.mouse.move(end.x, end.y, { steps: 8 });
  await page.mouse.up();
}

/** Returns the centre of a port, after the drawing has settled. */
export async function middle(page: Page, port: string): Promise<{ x: number; y: number }> {
  const handle = page.locator(`[data-port="${port}"]`).first();
  let box = await handle.boundingBox();
  for (let before = ""; before !== JSON.stringify(box); box = await handle.boundingBox()) {
    before = JSON.stringify(box);
    await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
  }
  if (!box) throw new Error(`port ${port} is not to be seen`);
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

export async function chosen(page: Page, box: string): Promise<void> {
  await page.locator(`[data-box="${box}"] strong`).click();
  await page.locator(".react-flow__node.selected").waitFor();
}
