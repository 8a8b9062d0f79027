// SPDX-License-Identifier: Apache-2.0
// The data flow of a running system, and a graph that is drawn, corrected, installed and viewed.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { chosen, middle, named, wire, wired } from "./flowing";
import { illegible } from "./large";
import {
  axeFindings,
  browse,
  command,
  goTo,
  LOOKS,
  type Look,
  type Opened,
  open,
  PATIENCE_MS,
  type Running,
  run,
  shoot,
  standsStill,
} from "./running";

let running: Running;
let browser: Browser;
let opened: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "program.py"), "--edit"), browse(false)]);
  opened = await open(browser, running.url);
}, 2 * PATIENCE_MS);

afterAll(async () => {
  await browser?.close();
  await running?.stop();
}, PATIENCE_MS);

const TIME = 3 * PATIENCE_MS;

test("what is installed is drawn, with values that move on its wires", { timeout: TIME }, async () => {
  const { page, errors } = opened;
  await goTo(page, "Data flow");
  await page.locator('[data-box="wave"]').first().waitFor();
  const value = page.locator('.wire-label [data-live="ur5e.shoulder_pan.commanded"]').first();
  const before = await value.textContent();
  await expect.poll(() => value.textContent(), { timeout: PATIENCE_MS }).not.toBe(before);
  await page.locator('[data-box="wave"]').first().click();
  await page.getByText("library.signal_generator").waitFor();
  // A box can be dragged, and stays where it is dropped.
  const box = page.locator('[data-box="wave"]').first();
  await standsStill(box);
  const from = await box.boundingBox();
  if (!from) throw new Error("the box is out of sight");
  const [x, y] = [from.x + from.width / 2, from.y + 12];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 30, y + 60, { steps: 6 });
  await page.mouse.up();
  await standsStill(box);
  const to = await box.boundingBox();
  expect(Math.round((to?.y ?? 0) - from.y)).toBeGreaterThan(30);
  expect(await axeFindings(page)).toEqual([]);
  expect(errors).toEqual([]);
});

test("what is hidden is found and shown; instances have a region each", { timeout: TIME }, async () => {
  const { page, errors } = opened;
  const move = page.getByRole("group", { name: "Instances shown" }).getByRole("checkbox", { name: /^move_absolute#1/ });
  expect(await move.isChecked()).toBe(false);
  await page.locator("h1").click();
  await page.keyboard.press("Control+f");
  const find = page.getByLabel("Find in the drawing");
  await find.fill("generator.goal");
  await find.press("Enter");
  await page.getByText(/^1 of \d+: generator\.goal, in move_absolute#1/).waitFor();
  await page.locator('.react-flow__node.selected[data-id="move_absolute#1/generator"]').waitFor();
  expect(await move.isChecked()).toBe(true);
  expect(await isSeen(page, "move_absolute#1/generator")).toBe(true);
  await find.press("Escape");
  for (const [grouping, regions] of [
    ["By instance", ["move_absolute#1", "sway#1"]],
    ["By source", ["rtp0.slow", "shared"]],
  ] as const) {
    await page.getByRole("button", { name: grouping }).click();
    for (const region of regions) await page.locator(`[data-region="${region}"]`).waitFor();
    for (const look of LOOKS) {
      await page.setViewportSize({ width: look.width, height: look.height });
      await page.emulateMedia({ colorScheme: look.scheme });
      expect(await axeFindings(page), `${grouping} ${look.width} ${look.scheme}`).toEqual([]);
      expect(await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)).toBe(0);
      expect(await illegible(page), `${grouping} ${look.width}`).toEqual([]);
      await shoot(page, `${grouping.replace(" ", "-")}-${look.width}-${look.scheme}`);
    }
    await page.setViewportSize({ width: 1440, height: 900 });
  }
  const [ground, box] = await Promise.all([
    page.locator('[data-region="rtp0.slow"]').boundingBox(),
    page.locator('.react-flow__node[data-id="move_absolute#1/generator"]').boundingBox(),
  ]);
  if (!ground || !box) throw new Error("the region and the block are to be seen");
  expect([box.x > ground.x, box.y > ground.y, box.x + box.width < ground.x + ground.width]).toEqual([true, true, true]);
  await page.getByRole("button", { name: "By source" }).click();
  expect(errors).toEqual([]);
});

/** Returns true if a box lies in the middle of the visible part of the drawing. */
async function isSeen(page: Page, id: string): Promise<boolean> {
  const [box, canvas] = await Promise.all([
    page.locator(`.react-flow__node[data-id="${id}"]`).boundingBox(),
    page.locator(".canvas").boundingBox(),
  ]);
  if (!box || !canvas) return false;
  const off = [box.x + box.width / 2 - canvas.x - canvas.width / 2, box.y + box.height / 2 - canvas.y - canvas.height / 2];
  return off.every((by) => Math.abs(by) < 40);
}

test("a graph is drawn, a wire refused and mended, installed, and its output seen in the scope", { timeout: 2 * TIME }, async () => {
  const { page, errors } = opened;
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.getByRole("button", { name: "New graph" }).click();
  await named(page, "Graph", "drawn");
  for (const component of ["signal_generator", "gain", "logic_not"]) await page.locator(`[data-component="library.${component}"]`).click();
  await page.getByRole("button", { name: "Add output" }).click();
  await page.getByRole("button", { name: "Arrange" }).click();
  await page.waitForFunction(() => {
    const at = (box: string) => document.querySelector(`[data-box="${box}"]`)?.getBoundingClientRect().top ?? 0;
    return at("gain") !== at("signal_generator");
  });

  await wire(page, "signal_generator.y", "logic_not.u");
  const refused = page.locator('[data-wire="refused"]');
  await refused.getByText("types differ").waitFor();
  expect(await refused.textContent()).toContain("bool");
  await wire(page, "signal_generator.y", "gain.u");
  await refused.waitFor({ state: "detached" });
  await wire(page, "gain.y", "output.value");
  await chosen(page, "logic_not");
  await page.keyboard.press("Delete");
  await page.locator('[data-box="logic_not"]').waitFor({ state: "detached" });
  await chosen(page, "gain");
  await named(page, "k", "3");
  await page.getByText("all passed").waitFor();
  expect(await axeFindings(page)).toEqual([]);
  await shoot(page, "editor");

  const saved = page.waitForEvent("download");
  await page.getByRole("button", { name: "Save file" }).click();
  const file = JSON.parse(readFileSync(await (await saved).path(), "utf8"));
  expect(file.graphs.drawn.blocks.gain).toEqual({ block: { subroutine: "library.gain" }, constants: { k: 3 } });

  await page.getByLabel("Source", { exact: true }).selectOption("rtp0.slow");
  const outputs = page.getByRole("link", { name: "Show its outputs in the scope" });
  await command(page.getByRole("button", { name: "Install and start" }), outputs);
  await outputs.click();
  await page.getByRole("main", { name: "Scope" }).waitFor();
  await page.getByText("drawn.output").locator("visible=true").first().waitFor();
  await page.waitForFunction(() => /received\s*[1-9]/i.test(document.body.textContent ?? ""));
  await shoot(page, "drawn-in-the-scope");
  // The trial is still in the same state.
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.getByRole("button", { name: "Halt and remove drawn" }).click();
  await page.getByRole("button", { name: "Install and start" }).waitFor();
  expect(errors).toEqual([]);
});

test("Ctrl+Z takes back one change of the draft, wherever the focus is, and brings back what was replaced", { timeout: TIME }, async () => {
  const { page, errors } = opened;
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await named(page, "Graph", "mine");
  await page.getByRole("button", { name: "New verb" }).click();
  await page.locator('[data-component="library.gain"]').click();
  await page.locator('[data-box="gain"]').waitFor();
  // A click moves nothing, so it adds no undo step.
  await chosen(page, "gain");
  await page.getByRole("button", { name: "Command lists" }).click();
  await page.locator("section").filter({ hasText: "Command lists" }).getByRole("button", { name: "Add" }).first().click();
  await page.locator('[data-list="list"]').waitFor();
  await page.locator("h1").click();
  await page.keyboard.press("Control+z");
  await page.locator('[data-list="list"]').waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Data flow", exact: true }).click();
  await page.keyboard.press("Control+z");
  await page.locator('[data-box="gain"]').waitFor({ state: "detached" });
  await page.keyboard.press("Control+z");
  await page.getByLabel("Graph", { exact: true }).waitFor();
  expect(await page.getByLabel("Graph", { exact: true }).inputValue()).toBe("mine");
  await page.keyboard.press("Control+z");
  expect(await page.getByLabel("Graph", { exact: true }).inputValue()).toBe("drawn");
  expect(errors).toEqual([]);
});

test("a wire is drawn by the keyboard, to what the system says fits", { timeout: TIME }, async () => {
  const { page, errors } = opened;
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.getByRole("button", { name: "New graph" }).click();
  for (const component of ["signal_generator", "gain", "logic_not"])
    await page.locator(`[data-component="library.${component}"]`).press("Enter");
  await chosen(page, "signal_generator");
  const wire = page.getByLabel("Wire signal_generator.y to");
  await wire.focus();
  await wire.locator("option", { hasText: "gain.u" }).waitFor({ state: "attached" });
  expect(await wire.locator("option").allTextContents()).not.toContain("logic_not.u");
  await wire.selectOption("gain.u");
  await chosen(page, "gain");
  await page.getByRole("button", { name: "Disconnect gain.u" }).waitFor();
  // Back to the previous draft.
  await page.locator("h1").click();
  for (let step = 0; step < 5; step += 1) await page.keyboard.press("Control+z");
  expect(await page.getByLabel("Graph", { exact: true }).inputValue()).toBe("drawn");
  expect(errors).toEqual([]);
});

test("a block is copied with its constants, by the keyboard", { timeout: TIME }, async () => {
  const { page, errors } = opened;
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await chosen(page, "gain");
  await page.keyboard.press("Control+c");
  await page.keyboard.press("Control+v");
  await page.locator('[data-box="gain2"]').waitFor();
  expect(await page.getByLabel("Label", { exact: true }).inputValue()).toBe("gain2");
  expect(await page.getByLabel("k", { exact: true }).inputValue()).toBe("3");
  await page.locator("h1").click();
  await page.keyboard.press("Control+z");
  await page.locator('[data-box="gain2"]').waitFor({ state: "detached" });
  expect(errors).toEqual([]);
});

test("two tabs have a draft each, and one that cannot be shown locks nothing", { timeout: TIME }, async () => {
  const { page, context } = opened;
  const other = await context.newPage();
  await other.goto(running.url);
  await goTo(other, "Data flow");
  await other.getByRole("button", { name: "Edit", exact: true }).click();
  await named(other, "Graph", "others");
  await page.reload();
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  expect(await page.getByLabel("Graph", { exact: true }).inputValue()).toBe("drawn");

  await other.evaluate(() => {
    const verb = { name: "broken", doc: "", blocks: {}, command_lists: { start: [] }, transitions: 7, conditions: {} };
    sessionStorage.setItem("opengpac.draft", JSON.stringify({ kind: "verb", of: verb }));
  });
  await other.reload();
  await goTo(other, "Data flow");
  await other.getByRole("button", { name: "Edit", exact: true }).click();
  await other.getByText("This draft cannot be displayed").waitFor();
  const saved = other.waitForEvent("download");
  await other.getByRole("button", { name: "Save the draft as a file" }).click();
  expect(readFileSync(await (await saved).path(), "utf8")).toContain('"broken"');
  await other.getByRole("button", { name: "Start over" }).click();
  await other.getByRole("button", { name: "New graph" }).waitFor();
  await other.close();
});

test("pictures at every width, light and dark", { timeout: 2 * TIME }, async () => {
  const { page, errors } = opened;
  const [wide] = LOOKS as [Look];
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.locator('[data-box="gain"]').waitFor();
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    await shoot(page, `edit-${look.width}-${look.scheme}`);
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
  }
  await page.setViewportSize({ width: wide.width, height: wide.height });
  await page.getByLabel("Open a verb of the system").focus();
  await page.getByLabel("Open a verb of the system").selectOption("sway");
  await page.locator('[data-box="side"]').waitFor();
  await page.getByRole("button", { name: "Command lists" }).click();
  await page.locator('[data-list="far"]').click();
  await page.getByRole("heading", { name: "Command list far" }).waitFor();
  await shoot(page, "edit-lists");
  expect(await axeFindings(page), "command lists").toEqual([]);
  expect(errors).toEqual([]);
});

test("a graph as a block is drawn within, and a port that disappears there is named at its wire", { timeout: TIME }, async () => {
  const { page, errors } = opened;
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.getByRole("button", { name: "New graph" }).click();
  await named(page, "Graph", "outer");
  await page.locator('[data-component="library.gain"]').click();
  await page.getByRole("button", { name: "an empty graph" }).click();
  await page.locator('[data-box="graph"] strong').dblclick();
  const where = page.getByRole("navigation", { name: "Path in the drawing" });
  await where.getByText("graph", { exact: true }).waitFor();
  await page.locator('[data-component="library.lowpass"]').click();
  await page.getByRole("button", { name: "Add output" }).click();
  await chosen(page, "lowpass");
  await wired(page, "Wire lowpass.y to", "output");
  await where.getByRole("button", { name: "outer" }).click();
  await chosen(page, "gain");
  await wired(page, "Wire gain.u from", "graph.output");
  await page.locator('.react-flow__edge[aria-label^="output: "]').waitFor({ state: "attached" });

  // Enter selects, and opens the selection.
  await page.locator('.react-flow__node[data-id="graph"]').focus();
  await page.keyboard.press("Enter");
  await page.getByRole("button", { name: "Open graph", exact: true }).waitFor();
  await page.locator('.react-flow__node[data-id="graph"]').focus();
  await page.keyboard.press("Enter");
  await where.getByText("graph", { exact: true }).waitFor();
  await chosen(page, "output");
  await named(page, "Name", "z");
  await where.getByRole("button", { name: "outer" }).click();
  await page.locator('[data-port="graph.z"]').waitFor();
  await page.locator('[data-box="graph"]').getByRole("button", { name: "Open graph graph" }).click();
  await chosen(page, "z");
  await page.keyboard.press("Delete");
  await page.locator('[data-box="z"]').waitFor({ state: "detached" });
  await where.getByRole("button", { name: "outer" }).click();
  await page.locator(".wire-label.wrong").getByText("'z'").first().waitFor();
  expect(await axeFindings(page)).toEqual([]);
  await shoot(page, "nested");
  expect(errors).toEqual([]);
});

test("what is within a graph is found from outside, and from within what is outside; names may be any", { timeout: TIME }, async () => {
  const { page, errors } = opened;
  const where = page.getByRole("navigation", { name: "Path in the drawing" });
  await chosen(page, "gain");
  await named(page, "Label", 'amp "x"');
  await page.locator("[data-port='amp \"x\".u']").waitFor();
  await page.locator('.react-flow__edge[aria-label*=" to u"]').first().waitFor({ state: "attached" });
  await page.locator("h1").click();
  await page.keyboard.press("Control+f");
  const find = page.getByLabel("Find in the drawing");
  await find.fill("lowpass.y");
  await find.press("Enter");
  await page.getByText("1 of 1: lowpass.y, in outer › graph").waitFor();
  await page.locator('.react-flow__node.selected[data-id="lowpass"]').waitFor();
  expect(await where.textContent()).toContain("graph");
  expect(await isSeen(page, "lowpass")).toBe(true);
  await find.fill("amp");
  await find.press("Enter");
  await page.locator(".react-flow__node.selected [data-box='amp \"x\"']").waitFor();
  expect(await where.count()).toBe(0);
  await find.press("Escape");
  await page.getByRole("button", { name: "Undo" }).click();
  await page.locator('[data-box="gain"]').waitFor();
  expect(errors).toEqual([]);
});

test("a wire that is dropped on nothing offers what fits; what is drawn is found by a few letters", { timeout: TIME }, async () => {
  const { page, errors } = opened;
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.getByRole("button", { name: "New graph" }).click();
  await page.locator('[data-component="library.signal_generator"]').click();
  await page.locator('[data-component="library.logic_not"]').click();
  const begin = await middle(page, "signal_generator.y");
  await page.mouse.move(begin.x, begin.y);
  await page.mouse.down();
  await page.mouse.move(begin.x + 60, begin.y + 90, { steps: 4 });
  await page.mouse.move(begin.x + 30, begin.y + 140, { steps: 4 });
  await page.mouse.up();
  const offer = page.getByRole("dialog");
  const field = offer.getByRole("combobox");
  await field.fill("logic");
  // Items of a bool are not offered for a double.
  await expect
    .poll(() => offer.getByRole("option").allTextContents(), { timeout: PATIENCE_MS })
    .not.toContainEqual(expect.stringContaining("logic_not.u"));
  await field.fill("lowpass.u");
  await offer.getByRole("option").first().getByText("lowpass.u").waitFor();
  expect(await axeFindings(page)).toEqual([]);
  await field.press("Enter");
  await page.locator('[data-box="lowpass"]').waitFor();
  await page.locator('.react-flow__edge[aria-label*="from y to u"]').waitFor({ state: "attached" });
  // With the keyboard alone: from the port of the selected block.
  await page.getByRole("button", { name: "New block at lowpass.y" }).press("Enter");
  await field.fill("gain.u");
  await offer.getByRole("option").first().getByText("gain.u").waitFor();
  await field.press("Enter");
  await page.locator('[data-box="gain"]').waitFor();

  await page.locator("h1").click();
  await page.keyboard.press("/");
  const find = page.getByLabel("Find in the drawing");
  await find.fill("lowp");
  await find.press("Enter");
  await page.locator('.react-flow__node.selected[data-id="lowpass"]').waitFor();
  await page.getByText(/^1 of \d+: lowpass/).waitFor();
  await find.press("Enter");
  await page.getByText(/^2 of \d+: /).waitFor();
  await page.setViewportSize({ width: 390, height: 844 });
  expect(await axeFindings(page)).toEqual([]);
  expect(await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)).toBe(0);
  await find.press("Escape");
  await page.setViewportSize({ width: LOOKS[0]?.width ?? 1440, height: LOOKS[0]?.height ?? 900 });
  await page.keyboard.press("Control+f");
  await find.waitFor();
  expect(errors).toEqual([]);
});

test("a block is placed on an interrupt source by dragging it there, or at its side", { timeout: TIME }, async () => {
  const { page, errors } = opened;
  await page.getByRole("button", { name: "By source" }).click();
  const region = page.locator('[data-region="rtp0.slow"]');
  await region.waitFor();
  await chosen(page, "gain");
  const runsOn = page.getByLabel("runs on");
  expect(await runsOn.inputValue()).toBe("");
  await Promise.all([standsStill(page.locator('[data-box="gain"]')), standsStill(region)]);
  const [from, to] = await Promise.all([page.locator('[data-box="gain"] strong').boundingBox(), region.boundingBox()]);
  if (!from || !to) throw new Error("the block and the source are to be seen");
  await page.mouse.move(from.x + 5, from.y + 5);
  await page.mouse.down();
  await page.mouse.move(to.x + 20, to.y + to.height / 2, { steps: 6 });
  await page.mouse.up();
  await expect.poll(() => runsOn.inputValue(), { timeout: PATIENCE_MS }).toBe("rtp0.slow");
  await page.getByRole("button", { name: "Undo" }).click();
  await expect.poll(() => runsOn.inputValue(), { timeout: PATIENCE_MS }).toBe("");
  await runsOn.selectOption("rtp0.fast");
  const fast = page.locator('[data-region="rtp0.fast"]');
  const isIn = async () => {
    const [box, ground] = await Promise.all([page.locator('[data-box="gain"]').boundingBox(), fast.boundingBox()]);
    return box !== null && ground !== null && box.x > ground.x && box.x < ground.x + ground.width;
  };
  await expect.poll(isIn, { timeout: PATIENCE_MS }).toBe(true);
  expect(await axeFindings(page)).toEqual([]);
  await shoot(page, "by-source");
  await page.getByRole("button", { name: "By source" }).click();
  expect(errors).toEqual([]);
});
