// SPDX-License-Identifier: Apache-2.0
// A system in which nothing is set up: each view says what would be there and how to add it, and offers nothing that cannot work.
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Commander } from "./commander";
import { axeFindings, browse, goTo, type Opened, open, type Running, run, shoot } from "./running";

let running: Running;
let browser: Browser;
let studio: Opened;
let program: Commander;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "empty.py"), "--role", "configure"), browse(false)]);
  studio = await open(browser, running.url);
  program = await Commander.open(running.url);
});

afterAll(async () => {
  await program?.close();
  await browser?.close();
  await running?.stop();
});

/** Views, the title of each when it is empty, and a part of its sentence about how something gets there. */
const EMPTY: [string, string, RegExp][] = [
  ["Start", "Nothing is set up in this system yet", /A program brings an arm with .*; things to try then appear here\./],
  ["System", "This system has no real-time processor yet", /A program creates one with .*processor/],
  ["Data flow", "Nothing is installed", /Enable a device, or create an instance of a verb .* appear here/],
  ["Verbs", "No verbs defined yet", /A program defines verbs when it first uses them: .*\. Or draw one in the view Data flow\./],
  ["Devices", "This system has no devices yet", /A program brings an arm with .*, signals with .*, and other machines with /],
  ["Scope", "No traces yet", /Find a value in the list: press .*, type a few letters of its name, and press Enter\./],
  ["Recordings", "No recordings yet", /Start one above, or in a program with cell\.record/],
  ["Workspaces", "No workspaces yet", /A workspace is a layout of .*Create one here.*, or ship one with a program/],
];

test.each(EMPTY)("the empty view %s says what would be there and how to add it", async (view, title, how) => {
  const { page, errors } = studio;
  await goTo(page, view);
  const empty = page.getByRole("main").locator(".empty").filter({ hasText: title });
  await empty.waitFor();
  expect(await empty.textContent()).toMatch(how);
  for (const width of [1440, 390]) {
    await page.setViewportSize({ width, height: 900 });
    expect(await axeFindings(page), `at ${width}`).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), `at ${width}`).toBe(true);
    await shoot(page, `empty-${view}-${width}`);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  expect(errors).toEqual([]);
});

test("the log without entries of a kind says how to see others", async () => {
  const { page } = studio;
  await goTo(page, "Log");
  await page.getByRole("main").getByRole("searchbox").fill("no entry has these words");
  const empty = page.getByRole("main").locator(".empty");
  await empty.getByText("No entry matches the filter").waitFor();
  await empty.getByText("Show more kinds, or shorten the text.").waitFor();
});

test("a recording for replay is offered only where it can begin: without split, and before the first interrupt source", async () => {
  const { page } = studio;
  await goTo(page, "Recordings");
  const offer = page.getByRole("checkbox", { name: "include external inputs, for replay" });
  await offer.waitFor();
  await page.getByLabel("Split").selectOption({ index: 1 });
  await offer.waitFor({ state: "detached" });
  await page.getByLabel("Split").selectOption({ index: 0 });
  await offer.check();
  const begin = async (name: string) => {
    await page.getByLabel("File").fill(name);
    await page.getByRole("button", { name: "Record", exact: true }).click();
    const row = page.locator("tr").filter({ has: page.getByRole("rowheader", { name: `${name}.mcap` }) });
    await row.getByText("records", { exact: true }).waitFor();
    return row;
  };
  await program.giveBack();
  const whole = await begin("whole");
  // A recording that begins later lacks the inputs since the first interrupt source.
  await program.take();
  await program.call("processor", { name: "rtp0" });
  await program.call("source", { processor: "rtp0", name: "fast", kind: "timer", priority: 80, period_ns: 1_000_000 });
  await offer.waitFor({ state: "detached" });
  await program.giveBack();
  const part = await begin("part");
  for (const row of [whole, part]) {
    await row.getByRole("button", { name: "Stop" }).click();
    await row.getByText("complete").waitFor();
  }
  await whole.getByText("replay", { exact: true }).waitFor();
  expect(await part.getByText("replay", { exact: true }).count()).toBe(0);
});
