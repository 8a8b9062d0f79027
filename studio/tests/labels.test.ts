// SPDX-License-Identifier: Apache-2.0
// No label of any view is broken within a word, at any width and zoom.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { texts as de } from "../src/language/de";
import { browse, type Opened, open, type Running, run, shoot, show } from "./running";

/** Every view, with a selector of its loaded content. */
const VIEWS: [string, string][] = [
  ["start", ".lead"],
  ["system", "table.sources tbody tr"],
  ["flow", "[data-box]"],
  ["verbs/sway", ".list.lit"],
  ["verbs/move_absolute", "form.start"],
  ["devices/ur5e.elbow", ".stage canvas"],
  ["scope", ".screen canvas"],
  ["log", ".line"],
  ["recordings", "form"],
  ["workspaces", "form"],
];
const WIDTHS = [390, 800, 1440];
/** Presses of a button that zooms out. */
const ZOOMS = 8;

let running: Running;
let browser: Browser;
let opened: Opened[];

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "program.py"), "--role", "configure"), browse()]);
  opened = await Promise.all([
    open(browser, running.url),
    open(browser, running.url, undefined, { locale: "de-AT", live: de["shell.live2"] }),
  ]);
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
});

/** Returns the visible words that begin on one line and end on another one. */
async function brokenWords(page: Page): Promise<string[]> {
  return await page.evaluate(() => {
    const broken = new Set<string>();
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = walker.nextNode(); node; node = walker.nextNode()) {
      const around = node.parentElement;
      if (!around?.checkVisibility({ visibilityProperty: true }) || around.closest("option, textarea, script, style")) continue;
      for (const word of (node.textContent ?? "").matchAll(/[\p{L}\p{N}]+/gu)) {
        const range = document.createRange();
        range.setStart(node, word.index);
        range.setEnd(node, word.index + word[0].length);
        const lines = new Set([...range.getClientRects()].map((line) => Math.round(line.bottom)));
        if (lines.size > 1) broken.add(`${word[0]} in '${around.textContent?.slice(0, 60)}' of ${around.className || around.tagName}`);
      }
    }
    return [...broken];
  });
}

/** Returns the titles of boxes that are higher than their boxes. */
async function highTitles(page: Page): Promise<string[]> {
  return await page.evaluate(() =>
    [...document.querySelectorAll<HTMLElement>(".box")]
      .filter((box) => (box.querySelector(".box-head > strong")?.getBoundingClientRect().height ?? 0) > box.getBoundingClientRect().height)
      .map((box) => box.dataset.box ?? ""),
  );
}

test.each(VIEWS)("no label of the view %s is broken within a word", async (view, content) => {
  for (const { page, errors } of opened) {
    await show(page, `#/${view}`);
    const [name = ""] = view.split("/");
    await page.locator(`main[data-view="${name}"] ${content}`).first().waitFor();
    for (const width of WIDTHS) {
      await page.setViewportSize({ width, height: 900 });
      expect(await brokenWords(page), `at ${width}`).toEqual([]);
      const out = page.locator(".react-flow__controls-zoomout").first();
      for (let zoom = 1; name === "flow" && zoom <= ZOOMS && (await out.isEnabled()); zoom += 1) {
        await out.click();
        expect(await brokenWords(page), `at ${width}, zoomed out ${zoom} times`).toEqual([]);
        expect(await highTitles(page), `at ${width}, zoomed out ${zoom} times`).toEqual([]);
        if (zoom === 4) await shoot(page, `flow-far-${width}`);
      }
    }
    expect(errors).toEqual([]);
  }
});
