// SPDX-License-Identifier: Apache-2.0
// Anything is done in the editor, by chance: no exception comes of it, and Undo leads exactly back to the start. A share of it, with another
// seed each day; `npm run test:random` does 10,000 actions. OPENGPAC_SEED, OPENGPAC_ACTIONS: another seed, or so many actions.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { act, randomOf } from "./randomActions";
import { browse, goTo, type Opened, open, type Running, run } from "./running";

const DAY_MS = 86_400_000;
const SEED = Number(process.env.OPENGPAC_SEED ?? Math.floor(Date.now() / DAY_MS));
const ACTIONS = Number(process.env.OPENGPAC_ACTIONS ?? 160);
/** In one round: each may be two changes, and 200 can be taken back. */
const ROUND = 80;

let running: Running;
let browser: Browser;
let studio: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "program.py"), "--edit"), browse(false)]);
  studio = await open(browser, running.url);
  await goTo(studio.page, "Data flow");
  await studio.page.getByRole("button", { name: "Edit", exact: true }).click();
});

let changes = 0;

afterAll(async () => {
  process.stdout.write(`${rounds.length * ROUND} actions from seed ${rounds[0]} on: ${changes} changes were taken back\n`);
  await browser?.close();
  await running?.stop();
});

const keptText = (page: Page) => page.evaluate(() => sessionStorage.getItem("opengpac.draft") ?? "");

/** Begins a round, with nothing before it that could be taken back: what Undo leaves behind, and a change then replaces, is gone for good. */
async function begin(page: Page, kind: number): Promise<string> {
  const start = await opened(page, kind);
  await page.reload();
  await goTo(page, "Data flow");
  const edit = page.getByRole("button", { name: "Edit", exact: true });
  const undo = page.getByRole("button", { name: "Undo", exact: true });
  await edit.or(undo).first().waitFor();
  if (await edit.isVisible()) await edit.click();
  await expect.poll(() => undo.isDisabled()).toBe(true);
  expect(await keptText(page)).toBe(start);
  return start;
}

/** Opens what a round begins with, a verb, a graph with one within, or a composition, and waits until it lies where it is to lie. */
async function opened(page: Page, kind: number): Promise<string> {
  if (kind === 2) {
    await page.getByRole("button", { name: "New composition" }).click();
    for (const verb of ["sway", "jog"]) {
      await page.getByLabel("Add a verb of the system").focus();
      await page.getByLabel("Add a verb of the system").selectOption(verb);
      await page.locator(`[data-part="${verb}"]`).waitFor();
    }
    return await keptText(page);
  }
  if (kind === 0) {
    await page.getByLabel("Open a verb of the system").focus();
    await page.getByLabel("Open a verb of the system").selectOption("sway");
    await page.locator('[data-box="side"]').waitFor();
  } else {
    await page.getByRole("button", { name: "New graph" }).click();
    for (const block of ["signal_generator", "gain", "lowpass"]) await page.locator(`[data-component="library.${block}"]`).click();
    await page.getByRole("button", { name: "an empty graph" }).click();
    await page.locator('[data-box="graph"]').waitFor();
  }
  await expect.poll(async () => Object.keys(JSON.parse(await keptText(page)).of.layout).length).toBeGreaterThan(0);
  return await keptText(page);
}

/** Takes back until the draft is that text; how many steps it were. Errors: `Error` where that never comes. */
async function undoTo(page: Page, text: string): Promise<number> {
  return await page.evaluate(async (wanted) => {
    const button = () =>
      [...document.querySelectorAll<HTMLButtonElement>(".flow.editing button")].find((one) => one.textContent === "Undo");
    for (let steps = 0; ; steps += 1) {
      if (sessionStorage.getItem("opengpac.draft") === wanted) return steps;
      const undo = button();
      if (!undo || undo.disabled) throw new Error(`nothing is left to take back after ${steps} steps`);
      undo.click();
      await new Promise((painted) => requestAnimationFrame(painted));
    }
  }, text);
}

const rounds = Array.from({ length: Math.ceil(ACTIONS / ROUND) }, (_, round) => SEED * 1000 + round);

test.each(rounds)("seed %i: no exception, and Undo leads exactly back to the start", { timeout: 900_000 }, async (seed) => {
  const { page, errors } = studio;
  // What an earlier round found is told there.
  errors.length = 0;
  const start = await begin(page, seed % 3);
  const random = randomOf(seed);
  const done: string[] = [];
  for (let action = 0; action < ROUND; action += 1) {
    done.push(await act(page, random));
    const isBroken = (await page.getByText("This draft cannot be shown").count()) > 0;
    expect([...errors, ...(isBroken ? ["the draft cannot be shown"] : [])], `seed ${seed}:\n${done.join("\n")}`).toEqual([]);
  }
  // What was begun is let go of: a wire, a field.
  await page.keyboard.press("Escape");
  const back = await undoTo(page, start).catch((why: Error) => why.message);
  expect(back, `seed ${seed}:\n${done.join("\n")}`).toBeTypeOf("number");
  changes += Number(back);
  expect(errors).toEqual([]);
});
