// SPDX-License-Identifier: Apache-2.0
// Pressing a finding of the editor's checks leads to the affected part.
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { activate, add, begin, block, choose, enter, panelOf, parameter, wire } from "./drawing";
import { axeFindings, browse, goTo, type Opened, open, type Running, run, shoot, standsStill } from "./running";

let running: Running;
let browser: Browser;
let opened: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(`${import.meta.dirname}/drawn_cell.py`, "--edit"), browse(false)]);
  opened = await open(browser, running.url, { width: 1440, height: 1000, scheme: "light" });
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
});

const finding = (page: Page, text: string) => panelOf(page, "Checks").getByRole("button").filter({ hasText: text });

test("a constant of another unit and a field that cannot be read are found, and lead there", async () => {
  const { page, errors } = opened;
  await expect.poll(() => running.said()).toContain("the modules are there");
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await begin(page, "wrong");
  await block(page, "library.signal_generator", "wave");
  await block(page, "library.signal_generator", "second");
  await add(page, "Objects", "Object", "joint", "joint", { type: "robot_joint" });
  await parameter(page, "joint.commanded");
  await wire(page, "wave", "Wire wave.y to", "joint.commanded");
  await wire(page, "second", "Wire second.y to", "joint.commanded");
  await choose(page, "wave");
  await enter(panelOf(page, "wave"), "frequency (Hz)", "3 rad");
  await finding(page, "cannot convert '3 rad' to Hz").click();
  // From another view: the block is selected, and the field of the constant has the focus.
  const focused = () => page.evaluate(() => document.activeElement?.closest("[data-place]")?.getAttribute("data-place"));
  await standsStill(page.locator('[data-box="second"]'));
  await choose(page, "second");
  await finding(page, "cannot convert '3 rad' to Hz").click();
  await panelOf(page, "wave").waitFor();
  expect(await focused()).toBe("item:frequency");
  await shoot(page, "checks-constant");
  await enter(panelOf(page, "wave"), "frequency (Hz)", "3 Hz");
  await finding(page, "cannot convert '3 rad'").waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Command lists" }).click();
  await activate(page, "start", ["wave", "second"], "20 ms");
  // As in the checks at installation: leads from the lists to one of the two.
  await finding(page, "'joint.commanded' has two active writers in command list 'start'").click();
  await page.locator('[data-box="wave"]').waitFor();
  await panelOf(page, "wave").waitFor();
  // Unreadable input is reported too, and nothing is installed meanwhile.
  await page.getByRole("button", { name: "Command lists" }).click();
  await page.locator('[data-list="start"]').click();
  const command = panelOf(page, "Command list start").getByRole("group", { name: "Command 2", exact: true });
  await enter(command, "every", "5 km");
  await finding(page, "The field “every” cannot be read").click();
  expect(await command.getByLabel("every", { exact: true }).evaluate((field) => document.activeElement === field)).toBe(true);
  expect(await page.getByRole("button", { name: "Install verb wrong" }).isDisabled()).toBe(true);
  await enter(command, "every", "20 ms");
  await finding(page, "The field “every” cannot be read").waitFor({ state: "detached" });
  expect(await axeFindings(page)).toEqual([]);
  expect(errors).toEqual([]);
});

test("findings about conditions, parameters, commands and what lies in a graph lead there", async () => {
  const { page, errors } = opened;
  const focused = () => page.evaluate(() => document.activeElement?.closest("[data-place]")?.getAttribute("data-place"));
  await begin(page, "astray");
  await block(page, "library.signal_generator", "wave");
  await add(page, "Conditions", "Condition", "done", "done", { is: "wave.above" });
  await finding(page, "'wave' (library.signal_generator) has no 'above'").click();
  await expect.poll(focused).toBe("condition:done");
  await add(page, "Input parameters", "Input parameter", "goal", "goal", { "stored in": "wave.freq" });
  await enter(panelOf(page, "Conditions").getByRole("group", { name: "Condition done" }), "is", "wave.y");
  await panelOf(page, "Conditions").getByRole("button", { name: "Remove condition done" }).click();
  await page.getByRole("button", { name: "Command lists" }).click();
  await activate(page, "start", ["wave"], "20 ms");
  await page.getByRole("button", { name: "Data flow" }).last().click();
  await finding(page, "has no 'freq'").click();
  await expect.poll(focused).toBe("parameter:goal");
  expect(errors).toEqual([]);
});
