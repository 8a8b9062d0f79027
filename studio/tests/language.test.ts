// SPDX-License-Identifier: Apache-2.0
// The page in German: no English text is left in the frame and the views, it passes the check of axe, and fits into narrow windows.
import { join } from "node:path";
import type { Browser, Dialog, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { texts as de } from "../src/language/de";
import { en } from "../src/language/en";
import type { Key, Message } from "../src/language/text";
import { axeFindings, browse, command, type Opened, open, type Running, run, STOP, shoot, show } from "./running";

/** Every view, with a selector of its loaded content. */
const VIEWS: [string, string][] = [
  ["start", ".lead"],
  ["system", "table.sources tbody tr"],
  ["flow", "[data-box]"],
  ["verbs/sway", ".list.lit"],
  ["devices/ur5e.elbow", ".stage canvas"],
  ["scope", ".screen canvas"],
  ["log", ".line"],
  ["recordings", "form"],
  ["workspaces", "form"],
];

let running: Running;
let browser: Browser;
let studio: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "program.py"), "--role", "configure"), browse()]);
  studio = await open(browser, running.url, undefined, { locale: "de-AT", live: de["shell.live2"] });
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
});

const GERMAN = new Set(Object.values(de).flatMap(formsOf));

/** Patterns of the English texts that are no German texts. */
const ENGLISH = (Object.keys(en) as Key[])
  .flatMap((key) => formsOf(en[key]).filter((text) => !GERMAN.has(text)))
  // Names of programs may be equal to a single word of the page.
  .filter((text) => /\p{L} \p{L}|^\p{Lu}\p{Ll}/u.test(text.replace(/\{\w+\}/g, "")))
  .map((text) => `^${text.replace(/[.*+?^$()|[\]\\]/g, "\\$&").replace(/\{\w+\}/g, "[^ ]+")}$`);

/** English words of the system, such as states, that are no German words. */
const WORDS = (Object.keys(en) as Key[])
  .filter((key) => key.startsWith("words.") && !GERMAN.has(String(en[key])))
  .map((key) => String(en[key]));

function formsOf(message: Message): string[] {
  return typeof message === "string" ? [message] : Object.values(message);
}

/** Returns the English texts of the page that a person sees or hears. */
async function englishOf(page: Page): Promise<string[]> {
  return await page.evaluate(
    ([patterns, words]) => {
      const english = patterns.map((pattern) => new RegExp(pattern));
      const shown: string[] = [];
      const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_ELEMENT | NodeFilter.SHOW_TEXT);
      for (let node = walker.nextNode(); node; node = walker.nextNode()) {
        if (node instanceof Element) shown.push(...["title", "aria-label", "placeholder"].map((name) => node.getAttribute(name) ?? ""));
        else if (!node.parentElement?.closest("code, kbd, pre, script, style, [lang='en']")) shown.push(node.textContent ?? "");
      }
      const texts = [...new Set(shown.map((text) => text.trim()))].filter((text) => text !== "" && english.some((one) => one.test(text)));
      // States and kinds are single words.
      const tags = [...document.querySelectorAll(".tag, .log .kind, option")].map((one) => one.textContent?.trim() ?? "");
      return [...texts, ...tags.filter((tag) => words.includes(tag))];
    },
    [ENGLISH, WORDS] as const,
  );
}

test("the page is in the browser's language, and declares it", async () => {
  const { page } = studio;
  expect(await page.locator("html").getAttribute("lang")).toBe("de");
  expect(await page.getByRole("navigation", { name: de["shell.views"] }).getByRole("link").allTextContents()).toEqual([
    ...(["start", "system", "dataFlow", "verbs", "devices", "scope", "log", "recordings", "workspaces"] as const).map(
      (name) => de[`shell.${name}`],
    ),
  ]);
});

test.each(VIEWS)("the view %s has no English text, passes the check of axe, and fits into the window", async (view, content) => {
  const { page, errors } = studio;
  await page.evaluate((to) => {
    location.hash = `#/${to}`;
  }, view);
  await page
    .locator(`main[data-view="${view.split("/")[0]}"] ${content}`)
    .first()
    .waitFor();
  for (const [width, height] of [
    [1440, 900],
    [390, 844],
  ] as const) {
    await page.setViewportSize({ width, height });
    expect(await englishOf(page), `at ${width}`).toEqual([]);
    expect(await axeFindings(page), `at ${width}`).toEqual([]);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    expect(wide, `wider than ${width} pixels`).toBeLessThanOrEqual(0);
    expect(JSON.stringify(await page.getByRole("button", { name: de["shell.emergencyStop"] }).boundingBox())).toBe(STOP);
    await shoot(page, `german-${view.split("/")[0]}-${width}`);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  expect(errors).toEqual([]);
});

test("wires are drawn, and each ends at two ports, as on an English page", async () => {
  const { page } = studio;
  await show(page, "#/flow");
  const wires = () => page.locator("main .react-flow__edge").count();
  await expect.poll(wires).toBeGreaterThan(20);
  const english = await open(browser, running.url);
  await show(english.page, "#/flow");
  const there = () => english.page.locator("main .react-flow__edge").count();
  await expect.poll(there).toBeGreaterThan(20);
  await expect.poll(async () => (await wires()) - (await there())).toBe(0);
  await english.context.close();
});

test("a German page says once that messages of the system and the help are in English", async () => {
  const { page } = studio;
  await show(page, "#/start");
  await page.getByText(de["start.messagesAndHelpAreInEnglish"]).waitFor();
});

test("a change of the language asks nothing, and what the page has started keeps running", async () => {
  const { page } = studio;
  const choice = (name: string) => page.getByRole("combobox", { name, exact: true });
  const asked: string[] = [];
  const answer = (dialog: Dialog) => {
    asked.push(dialog.type());
    void dialog.accept();
  };
  page.on("dialog", answer);
  const asks = () => page.evaluate(() => !window.dispatchEvent(new Event("beforeunload", { cancelable: true })));
  expect(await asks()).toBe(false);
  await show(page, "#/verbs/sway");
  const form = page.locator("form.start");
  await form.waitFor();
  await form.locator("select").first().selectOption("ur5e.wrist_3");
  await form.getByLabel("place").fill("0");
  const rows = page.locator(".instances > li");
  const before = await rows.count();
  await command(form.getByRole("button", { name: de["verbs.start"], exact: true }), rows.nth(before));
  // A page that is closed asks.
  await expect.poll(asks).toBe(true);
  await choice(de["language.language"]).selectOption("English");
  await choice(en["language.language"]).waitFor();
  expect(asked).toEqual([]);
  await rows.nth(before).getByText("running", { exact: true }).waitFor();
  // So does the reloaded page.
  await expect.poll(asks).toBe(true);
  await command(rows.nth(before).getByRole("button", { name: en["verbs.halt"] }), rows.nth(before).getByText("ended", { exact: true }));
  await expect.poll(asks).toBe(false);
  await choice(en["language.language"]).selectOption(en["language.automatic"]);
  await choice(de["language.language"]).waitFor();
  page.off("dialog", answer);
});

test("a language that is chosen is kept, and the browser's returns with 'automatic'", async () => {
  const { page } = studio;
  const choice = (name: string) => page.getByRole("combobox", { name, exact: true });
  await choice(de["language.language"]).selectOption("English");
  await choice(en["language.language"]).waitFor();
  await page.reload();
  await choice(en["language.language"]).waitFor();
  expect(await page.locator("html").getAttribute("lang")).toBe("en");
  expect(await choice(en["language.language"]).inputValue()).toBe("en");
  await choice(en["language.language"]).selectOption(en["language.automatic"]);
  await choice(de["language.language"]).waitFor();
  expect(await page.locator("html").getAttribute("lang")).toBe("de");
});
