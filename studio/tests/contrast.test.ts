// SPDX-License-Identifier: Apache-2.0
// High contrast: chosen with the switch, requested by the operating system, and with the colours of the operating system.
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { axeFindings, browse, goTo, type Opened, open, type Running, run, shoot } from "./running";

/** Every view, with a selector of its loaded content. */
const VIEWS: [string, string][] = [
  ["Start", ".lead"],
  ["System", "table.sources tbody tr"],
  ["Data flow", "[data-box]"],
  ["Verbs", ".list.lit"],
  ["Devices", ".stage canvas"],
  ["Scope", ".screen canvas"],
  ["Log", ".line"],
  ["Recordings", "form"],
  ["Workspaces", "form"],
];

let running: Running;
let browser: Browser;
let studio: Opened;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "program.py"), "--role", "configure"), browse()]);
  studio = await open(browser, running.url);
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
});

test("it follows the operating system, unless another scheme is chosen", async () => {
  const { page } = studio;
  const html = page.locator("html");
  const colours = page.getByRole("combobox", { name: "Colours" });
  expect(await html.getAttribute("data-contrast")).toBeNull();
  await page.emulateMedia({ contrast: "more" });
  await page.locator('html[data-contrast="more"]').waitFor();
  await colours.selectOption("light");
  expect(await html.getAttribute("data-contrast")).toBeNull();
  await page.emulateMedia({ contrast: "no-preference" });
  await colours.selectOption("high contrast");
  expect(await html.getAttribute("data-contrast")).toBe("more");
  await page.reload();
  await page.getByText("live", { exact: true }).waitFor();
  expect(await html.getAttribute("data-contrast")).toBe("more");
});

test.each(VIEWS)("the view %s passes the check of axe with a contrast of 7, light, dark and with forced colours", async (view, content) => {
  const { page, errors } = studio;
  await goTo(page, view);
  await page.locator(`main ${content}`).first().waitFor();
  const name = view.toLowerCase().replace(" ", "-");
  for (const colorScheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme });
    await shoot(page, `contrast-${name}-${colorScheme}`);
    expect(await axeFindings(page, true), colorScheme).toEqual([]);
  }
  await page.emulateMedia({ colorScheme: "dark", forcedColors: "active" });
  await shoot(page, `contrast-${name}-forced`);
  expect(await axeFindings(page), "forced colours").toEqual([]);
  await page.emulateMedia({ colorScheme: null, forcedColors: null });
  expect(errors).toEqual([]);
});
