// SPDX-License-Identifier: Apache-2.0
// Actions of a user in the editor: blocks, wires, parameters, lists.
import type { Locator, Page } from "playwright-core";

export async function enter(of: Page | Locator, label: string, text: string): Promise<void> {
  const field = of.getByLabel(label, { exact: true });
  await field.fill(text);
  await field.press("Enter");
}

export const panelOf = (page: Page, title: string) =>
  page.locator("section.panel").filter({ has: page.getByRole("heading", { name: title, exact: true }) });

/** Adds a block with this label and these constants. */
export async function block(page: Page, component: string, label: string, constants: Record<string, string> = {}): Promise<void> {
  await page.locator(`[data-component="${component}"]`).click();
  const panel = panelOf(page, component.split(".")[1] ?? "");
  await enter(panel, "Label", label);
  for (const [name, value] of Object.entries(constants)) await enter(panelOf(page, label), name, value);
  await page.locator(`[data-box="${label}"]`).waitFor();
}

export async function choose(page: Page, box: string): Promise<void> {
  await page.locator(`[data-box="${box}"] strong`).click();
  await panelOf(page, box).waitFor();
}

/** Returns the displacement between two boxes, in widths of the first: the same at each zoom. */
export async function apart(page: Page, from: string, to: string): Promise<string> {
  const [one, other] = await Promise.all([from, to].map((box) => page.locator(`[data-box="${box}"]`).boundingBox()));
  if (!one || !other) return "one is out of sight";
  return [other.x - one.x, other.y - one.y].map((way) => (way / one.width).toFixed(1)).join(" ");
}

/** Draws a wire with the keyboard; `from` and `to` are ports or boundaries in the panel of the block. */
export async function wire(page: Page, label: string, field: string, other: string): Promise<void> {
  await choose(page, label);
  const choice = page.getByLabel(field, { exact: true });
  await choice.focus();
  await choice.locator("option", { hasText: other }).first().waitFor({ state: "attached" });
  await choice.selectOption(other);
}

/** Names the cell of the selected wire. */
export async function nameCell(page: Page, before: string, to: string): Promise<void> {
  await page.locator(`.react-flow__edge[aria-label^="${before}: "]`).first().focus();
  await page.keyboard.press("Enter");
  await enter(panelOf(page, `Wire ${before}`), "Cell", to);
}

export async function parameter(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: "Add instantiation parameter" }).click();
  await choose(page, "instantiation");
  await enter(panelOf(page, "instantiation"), "Name", name);
  await panelOf(page, name).waitFor();
}

/** Adds an entry to one of the verb's lists, and fills its fields. */
export async function add(
  page: Page,
  title: string,
  one: string,
  fresh: string,
  name: string,
  fields: Record<string, string>,
): Promise<void> {
  const panel = panelOf(page, title);
  await panel.getByRole("button", { name: "Add", exact: true }).click();
  const made = panel.getByRole("group", { name: `${one} ${fresh}`, exact: true });
  if (name !== fresh) await enter(made, "Name", name);
  const named = panel.getByRole("group", { name: `${one} ${name}`, exact: true });
  for (const [label, text] of Object.entries(fields)) await enter(named, label, text);
}

/** Fills the selected list with commands: all blocks are activated at an interval. */
export async function activate(page: Page, list: string, blocks: string[], every: string): Promise<void> {
  await page.locator(`[data-list="${list}"]`).click();
  const panel = panelOf(page, `Command list ${list}`);
  for (const [index, label] of blocks.entries()) {
    await panel.getByRole("button", { name: "Add command" }).click();
    await panel.getByLabel(`Command ${index + 1}: block`).selectOption(label);
    const command = panel.getByRole("group", { name: `Command ${index + 1}`, exact: true });
    if ((await command.getByLabel("every").inputValue()) !== every) await enter(command, "every", every);
  }
}

export async function rename(page: Page, list: string, to: string): Promise<void> {
  await page.locator(`[data-list="${list}"]`).click();
  await enter(panelOf(page, `Command list ${list}`), "Name", to);
  await page.locator(`[data-list="${to}"]`).waitFor();
}

export async function begin(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: "New verb" }).click();
  await enter(page, "Verb", name);
}
