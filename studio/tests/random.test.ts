// SPDX-License-Identifier: Apache-2.0
// Random actions in the editor: none raises an exception, and Undo leads exactly back to the start. A part of the campaign runs each day
// with a new seed; `npm run test:random` runs 10,000 actions. OPENGPAC_SEED sets the seed, OPENGPAC_ACTIONS the number of actions.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { act, randomOf } from "./randomActions";
import { browse, goTo, type Opened, open, type Running, run } from "./running";

const DAY_MS = 86_400_000;
const SEED = Number(process.env.OPENGPAC_SEED ?? Math.floor(Date.now() / DAY_MS));
const ACTIONS = Number(process.env.OPENGPAC_ACTIONS ?? 160);
/** Number of actions in one round: each may be two changes, and 200 can be undone. */
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

/** Begins a round with an empty undo history, since a change after Undo permanently discards the undone states. */
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

/** Opens the initial draft of a round, a verb, a nested graph, or a composition, and waits until its layout has settled. */
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

/** Undoes until the draft equals this text; returns the number of steps. Throws an `Error` if it never does. */
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
  // Errors of an earlier round have been reported already.
  errors.length = 0;
  const start = await begin(page, seed % 3);
  const random = randomOf(seed);
  const done: string[] = [];
  for (let action = 0; action < ROUND; action += 1) {
    done.push(await act(page, random));
    const isBroken = (await page.getByText("This draft cannot be displayed").count()) > 0;
    expect([...errors, ...(isBroken ? ["the draft cannot be shown"] : [])], `seed ${seed}:\n${done.join("\n")}`).toEqual([]);
  }
  // Abandons an unfinished wire or field.
  await page.keyboard.press("Escape");
  const back = await undoTo(page, start).catch((why: Error) => why.message);
  expect(back, `seed ${seed}:\n${done.join("\n")}`).toBeTypeOf("number");
  changes += Number(back);
  expect(errors).toEqual([]);
});
