// SPDX-License-Identifier: Apache-2.0
// A recording in the views of the running system: all views show the time of one cursor, with the values of gpac.open_recording.
import { type ChildProcess, execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { freePort, serve, tokenIn } from "./daemon";
import { axeFindings, browse, goTo, LOOKS, type Opened, open, PYTHON, STOP, SURROUNDINGS, shoot, stopRectangles } from "./running";

interface Said {
  name: string;
  count: number;
  min: number;
  max: number;
  conditions: { time_s: number; about: string; text: string }[];
  /** Times, s, and the values at them. */
  at: [number, number][];
}

let folder: string;
let daemon: ChildProcess | undefined;
let browser: Browser;
let studio: Opened;
let said: Said;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), "studio-recorded-"));
  const made = execFileSync(PYTHON, [join(import.meta.dirname, "recorded.py"), folder], { env: SURROUNDINGS }).toString();
  said = JSON.parse(/^said: (.*)$/m.exec(made)?.[1] ?? "") as Said;
  const [token, port] = [tokenIn(folder), await freePort()];
  [daemon, browser] = await Promise.all([serve(folder, port), browse()]);
  studio = await open(browser, `http://127.0.0.1:${port}/#token=${token}`);
});

afterAll(async () => {
  await browser?.close();
  daemon?.kill("SIGKILL");
  rmSync(folder, { recursive: true, force: true });
});

/** Returns the time at which the views stand, s. */
async function cursor(page: Page): Promise<number> {
  return Number.parseFloat((await page.getByTestId("cursor").textContent()) ?? "");
}

/** Presses a button and waits until the cursor has moved. */
async function press(page: Page, name: string): Promise<[number, number]> {
  const before = await cursor(page);
  await page.getByRole("region", { name: "Time", exact: true }).getByRole("button", { name, exact: true }).click();
  await expect.poll(() => cursor(page)).not.toBe(before);
  return [before, await cursor(page)];
}

test("the recordings of the folder are told: when, which verbs, how they ended, and what they are", async () => {
  const { page } = studio;
  await goTo(page, "Recordings");
  const row = page.locator("tr").filter({ has: page.getByRole("rowheader", { name: "run.mcap" }) });
  await row.getByText("complete", { exact: true }).waitFor();
  const text = (await row.textContent()) ?? "";
  for (const part of ["of bench", "sway", "halted"]) expect(text).toContain(part);
  expect(text).toMatch(/12\.\d{3} s/);
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    await shoot(page, `recordings-${look.width}-${look.scheme}`);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  await row.getByRole("button", { name: "Open" }).click();
  await page.getByRole("main", { name: "Log" }).waitFor();
  await page.locator(".time-bar.recorded").waitFor();
});

test("from a condition to the pose of the arm in two clicks, with the value that was stored", async () => {
  const { page } = studio;
  const lines = page.locator(".line").filter({ hasText: "condition" });
  await lines.nth(1).click();
  await goTo(page, "Devices");
  await page.locator('.stage[data-placed="yes"]').waitFor();
  expect(await cursor(page)).toBeCloseTo(said.conditions[1]?.time_s ?? 0, 6);
});

test("the path of the tool, a ghost of what is commanded and frames are drawn at the cursor", async () => {
  const { page } = studio;
  const beside = page.getByRole("group", { name: "Drawn with the machine" });
  await beside.getByLabel("Path").selectOption("5");
  await beside.getByLabel("Ghost").selectOption("commanded");
  await beside.getByLabel("frames").check();
  const stage = page.locator('.stage[data-ghost="commanded"]');
  await stage.waitFor();
  // The joint sways by 0.4 rad within these 10 s: the tool has been in many positions.
  await expect.poll(async () => Number(await stage.getAttribute("data-path"))).toBeGreaterThan(20);
  await press(page, "Next condition");
  await expect.poll(async () => Number(await stage.getAttribute("data-path"))).toBeGreaterThan(20);
  await shoot(page, "recorded-path");
  await press(page, "Previous condition");
  await beside.getByLabel("Path").selectOption("0");
  await beside.getByLabel("Ghost").selectOption("goal");
  await page.locator('.stage[data-ghost="goal"]').waitFor();
  await beside.getByLabel("Ghost").selectOption("");
  await beside.getByLabel("frames").uncheck();
  await page.locator(".stage:not([data-ghost]):not([data-path])").waitFor();
});

test("at every time the views have the values of gpac.open_recording", async () => {
  const { page } = studio;
  const shown = page.locator(`[data-live="${said.name}"]`).first();
  const slider = page.getByLabel("Time in the recording");
  for (const [moment, value] of said.at) {
    // The nearest step of the slider, and from there by firings to the exact time.
    await slider.evaluate(
      (element, [time]) => {
        const of = element as HTMLInputElement;
        const put = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value")?.set;
        put?.call(of, String(time));
        of.dispatchEvent(new Event("input", { bubbles: true }));
      },
      [Math.round((moment / 12.5) * 100_000)] as const,
    );
    for (let steps = 0; steps < 200 && Math.abs((await cursor(page)) - moment) > 0.0006; steps += 1) {
      await press(page, (await cursor(page)) < moment ? "Next firing" : "Previous firing");
    }
    await expect.poll(async () => Math.abs(Number(await shown.textContent()) - value)).toBeLessThan(2e-3);
  }
});

test("the emergency stop of the running system stands where it always does", async () => {
  expect(await stopRectangles(studio.page)).toEqual([STOP]);
});

test("it is stepped by firing, by condition and by entry of the log, and it plays", async () => {
  const { page } = studio;
  const [before, after] = await press(page, "Next firing");
  expect(after - before).toBeGreaterThan(0);
  expect(after - before).toBeLessThan(0.0011);
  const [, condition] = await press(page, "Previous condition");
  expect(said.conditions.some((entry) => Math.abs(entry.time_s - condition) < 1e-6)).toBe(true);
  await press(page, "Next log entry");
  await page.getByLabel("Rate").selectOption("0.01");
  const playing = await cursor(page);
  await expect.poll(() => cursor(page)).toBeGreaterThan(playing);
  await page.locator(".time-bar").getByRole("button", { name: "Stop" }).click();
});

test("the state diagram is lit where it was then, and the data flow has the values of then", async () => {
  const { page } = studio;
  for (let back = 0; back < 20 && (await cursor(page)) > 3; back += 1) await press(page, "Previous condition");
  const [, at] = await press(page, "Next condition");
  const entry = said.conditions.find((one) => Math.abs(one.time_s - at) < 1e-6);
  await goTo(page, "Verbs");
  await page.locator(".verb-list").getByRole("link", { name: /^sway/ }).click();
  await page.locator(`.list.lit[data-list="${entry?.text.includes("rose") ? "far" : "near"}"]`).waitFor();
  await page.getByText("return to Live").waitFor();
  await goTo(page, "Data flow");
  await page.locator("[data-box]").first().waitFor();
  await expect.poll(async () => await page.locator("[data-live]").filter({ hasText: /\d/ }).count()).toBeGreaterThan(0);
});

test("the scope shows the whole recording, measured over all its values", async () => {
  const { page } = studio;
  await page.evaluate((name) => {
    window.location.hash = `#/scope?names=${name}`;
  }, said.name);
  await page.getByRole("main", { name: "Scope" }).waitFor();
  const cell = (name: string) => page.locator(`tr[data-trace="${said.name}"] [data-cell="${name}"]`);
  await expect.poll(async () => Number(await cell("max").textContent())).toBeCloseTo(said.max, 3);
  expect(Number(await cell("min").textContent())).toBeCloseTo(said.min, 3);
  await expect.poll(async () => ((await page.getByTestId("values").textContent()) ?? "").replace(/\D/g, "")).toBe(String(said.count));
  // A press on the screen moves the cursor there.
  const before = await cursor(page);
  const box = await page.locator(".u-over").boundingBox();
  if (!box) throw new Error("the scope has no screen");
  const pressed = async () => {
    await page.mouse.click(box.x + box.width * 0.75, box.y + box.height / 2);
    return await cursor(page);
  };
  // The values are listed before they are drawn, and until then a position on the screen has no time: repeats the press.
  await expect.poll(pressed, { interval: 1000 }).not.toBe(before);
  expect(await cursor(page)).toBeGreaterThan(8);
  await shoot(page, "recorded-scope");
  // *Time* is the time on the screen: the whole recording, then the chosen time around the cursor, then the whole again.
  const time = page.getByRole("toolbar", { name: "Scope" }).getByRole("combobox", { name: "Time", exact: true });
  const whole = Number(await time.inputValue());
  expect(whole).toBeGreaterThan(8);
  await time.selectOption("5");
  await expect.poll(() => time.inputValue()).toBe("5");
  const shown = async () => Number(((await page.getByTestId("values").textContent()) ?? "").replace(/\D/g, ""));
  await expect.poll(shown).toBeLessThan(said.count);
  await page.getByRole("group", { name: /^Screen/ }).focus();
  await page.keyboard.press("Home");
  await expect.poll(shown).toBe(said.count);
  expect(Number(await time.inputValue())).toBe(whole);
});

test("a formula over traces is a trace, and one that is not understood is refused with its place", async () => {
  const { page } = studio;
  const field = page.getByLabel("Formula");
  await field.fill(`2 * ${said.name} +`);
  await page.getByRole("button", { name: "Add", exact: true }).click();
  await page.getByRole("alert").getByText("invalid at its end").waitFor();
  const text = `2 * ${said.name} + 1`;
  await field.fill(text);
  await page.getByRole("button", { name: "Add", exact: true }).click();
  const cell = (name: string) => page.locator(`tr[data-trace="${text}"] [data-cell="${name}"]`);
  await expect.poll(async () => Number(await cell("max").textContent())).toBeCloseTo(2 * said.max + 1, 3);
  expect(Number(await cell("min").textContent())).toBeCloseTo(2 * said.min + 1, 3);
  // Computed values are not counted among those of the recording.
  expect(((await page.getByTestId("values").textContent()) ?? "").replace(/\D/g, "")).toBe(String(said.count));
  await shoot(page, "recorded-formula");
  expect(await axeFindings(page)).toEqual([]);
  await page.getByRole("button", { name: `Remove ${text}` }).click();
  await cell("max").waitFor({ state: "detached" });
});

/** Returns the text that a press saves. */
async function saved(page: Page, name: string): Promise<string> {
  const coming = page.waitForEvent("download");
  await page.getByRole("toolbar", { name: "Scope" }).getByRole("button", { name, exact: true }).click();
  return readFileSync(await (await coming).path(), "utf8");
}

test("a file of what is seen has every value, and the drawing has every line", async () => {
  const { page } = studio;
  const csv = await saved(page, "CSV");
  const rows = csv
    .trim()
    .split("\n")
    .filter((line) => !line.startsWith("#"));
  expect(rows[0]).toContain(said.name);
  expect(rows.length - 1).toBe(said.count);
  const values = rows.slice(1).map((row) => Number(row.split(",")[1]));
  expect([Math.min(...values), Math.max(...values)]).toEqual([said.min, said.max]);
  const svg = await saved(page, "SVG");
  expect([...svg.matchAll(/<path /g)]).toHaveLength(1);
  expect(svg).toContain(said.name);
});

test("two runs lie over each other, aligned at a condition", async () => {
  const { page } = studio;
  const tools = page.getByRole("toolbar", { name: "Scope" });
  await tools.getByLabel("Beside").selectOption("later.mcap");
  const behind = page.locator(`tr[data-trace="${said.name}"][data-reference]`);
  await behind.getByText("later.mcap").waitFor();
  await tools.getByRole("button", { name: "Cursors" }).click();
  const at = async (cell: string) => {
    const rows = page.locator(`tr[data-trace="${said.name}"] [data-cell="${cell}"]`);
    return (await rows.allTextContents()).map(Number);
  };
  const apart = async () => {
    const [here, there] = await at("a");
    return here === undefined || there === undefined ? Number.NaN : Math.abs(here - there);
  };
  // Initially, one is 0.7 s behind the other.
  await expect.poll(apart).toBeGreaterThan(0.05);
  await tools.getByLabel("Aligned at").selectOption("sway: rose");
  await tools.getByLabel("here", { exact: true }).selectOption({ label: "1 of 3" });
  await expect.poll(apart).toBeLessThan(0.02);
  expect([...(await saved(page, "SVG")).matchAll(/<path /g)]).toHaveLength(2);
  await shoot(page, "recorded-beside");
  // Their spectra too, of all values of both.
  await tools.getByRole("button", { name: "Cursors" }).click();
  await tools.getByLabel("X axis").selectOption("frequency");
  const strongest = page.locator(`tr[data-trace="${said.name}"] [data-cell="peak"]`);
  await expect.poll(async () => (await strongest.allTextContents()).filter((text) => Number(text) > 0)).toHaveLength(2);
  expect([...(await saved(page, "SVG")).matchAll(/<path /g)]).toHaveLength(2);
  await shoot(page, "recorded-beside-spectra");
  await tools.getByLabel("X axis").selectOption("");
  await tools.getByRole("button", { name: "Cursors" }).click();
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    expect(await axeFindings(page), `beside ${look.width} ${look.scheme}`).toEqual([]);
    await shoot(page, `recorded-beside-${look.width}-${look.scheme}`);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  await tools.getByLabel("Beside").selectOption("");
  await behind.waitFor({ state: "detached" });
  await tools.getByRole("button", { name: "Cursors" }).click();
});

test("an alarm that was raised stands at the cursor, and every view passes the check of axe", async () => {
  const { page, errors } = studio;
  await page.getByLabel("Alarms at the cursor").getByText("hot").waitFor();
  for (const view of ["System", "Data flow", "Verbs", "Devices", "Scope", "Log"]) {
    await goTo(page, view);
    for (const look of LOOKS) {
      await page.setViewportSize({ width: look.width, height: look.height });
      await page.emulateMedia({ colorScheme: look.scheme });
      expect(await axeFindings(page), `${view} ${look.width} ${look.scheme}`).toEqual([]);
      await shoot(page, `recorded-${view.toLowerCase().replace(" ", "-")}-${look.width}-${look.scheme}`);
      const wide = () => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      await expect.poll(wide, { message: `${view} is wider than ${look.width} pixels` }).toBeLessThanOrEqual(0);
    }
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  expect(errors).toEqual([]);
});

test("the running system can be held still, and goes on", async () => {
  const { page } = studio;
  const bar = page.locator(".time-bar");
  await bar.getByRole("button", { name: "Live" }).click();
  await goTo(page, "Log");
  await page.locator(".line").nth(2).waitFor();
  await bar.getByRole("button", { name: "Pause page" }).click();
  await page.getByText("the display is frozen").waitFor();
  const clock = () => page.locator(".bar .clock .figures").textContent();
  const passes = async () => {
    const now = await clock();
    await expect.poll(clock).not.toBe(now);
  };
  // All existing lines: the number drawn depends on the visible part.
  const lines = () => page.getByRole("group", { name: "Lines of the log" }).evaluate((box) => box.firstElementChild?.clientHeight ?? 0);
  // The system continues: its clock at the top advances, the lines do not.
  await passes();
  const held = await lines();
  await passes();
  expect(await lines()).toBe(held);
  await bar.getByRole("button", { name: "Live" }).click();
  await expect.poll(lines).toBeGreaterThan(held);
});
