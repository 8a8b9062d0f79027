// SPDX-License-Identifier: Apache-2.0
// The scope with 64 SVVs at 1 kHz: stored values are counted end to end; trigger, cursors, export.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Commander } from "./commander";
import { axeFindings, browse, LOOKS, type Opened, open, PATIENCE_MS, type Running, run, shoot } from "./running";

const CHANNELS = Array.from({ length: 64 }, (_, i) => `bank.c${String(i).padStart(2, "0")}`);

let running: Running;
let browser: Browser;
let studio: Opened;
let commander: Commander;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "channels.py")), browse(false)]);
  commander = await Commander.open(running.url);
  studio = await open(browser, running.url);
  await studio.page.evaluate((names) => {
    window.location.hash = `#/scope?names=${names}`;
  }, CHANNELS.join(","));
  await studio.page.getByText(/^64 channels/).waitFor();
});

afterAll(async () => {
  await commander?.close();
  await browser?.close();
  await running?.stop();
});

/** Returns the counts under the screen. */
async function counted(): Promise<{ received: number; lost: number }> {
  const read = async (id: string) => Number(((await studio.page.getByTestId(id).textContent()) ?? "").replaceAll(/\D/g, ""));
  return { received: await read("received"), lost: await read("lost") };
}

async function until(said: string, true_: () => Promise<boolean>): Promise<void> {
  const end = Date.now() + PATIENCE_MS;
  while (!(await true_())) {
    if (Date.now() > end) throw new Error(`it did not happen that ${said}`);
    await studio.page.waitForTimeout(100);
  }
}

test("every value of 64 channels at 1 kHz is received, none is lost", async () => {
  const { page } = studio;
  await commander.start("waves");
  await until("3,000 values of each channel came", async () => {
    const { received, lost } = await counted();
    return received + lost >= 64 * 3000;
  });
  await commander.halt("waves");
  const stored = 64 * (await commander.value("bank.c63"));
  await until("all that was stored came to the page", async () => {
    const { received, lost } = await counted();
    return received + lost >= stored;
  });
  expect(await counted()).toEqual({ received: stored, lost: 0 });
  await shoot(page, "scope-64-channels");
});

test("a trigger is shown with what was before it, cursors read it, and it can be exported", async () => {
  const { page } = studio;
  await commander.start("waves");
  await page.evaluate(() => {
    window.location.hash = `#/scope?setup=${encodeURIComponent(
      JSON.stringify({
        traces: [0, 1].map((i) => ({ channel: `bank.c0${i}`, component: "", look: i })),
        sweep: "single",
        span_s: 0.5,
        pre_s: 0.2,
        trigger: { on: "level", channel: "bank.c00", component: "", edge: "rising", level: 0.5, hysteresis: 0 },
      }),
    )}`;
  });
  await page.getByText("complete", { exact: true }).waitFor();
  await page.getByText(/ms from the trigger; 0 is at/).waitFor();
  await page.getByRole("button", { name: "Cursors", exact: true }).click();
  const a = page.getByRole("slider", { name: "Cursor A" });
  await a.focus();
  await page.keyboard.press("Shift+ArrowLeft");
  expect(await page.getByTestId("cursor-difference").textContent()).toMatch(/ms$/);
  const row = page.locator('tr[data-trace="bank.c00"]');
  await until("the value at the cursor is shown", async () => (await row.locator('[data-cell="a"]').textContent()) !== "–");
  const [saved] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "CSV" }).click()]);
  const lines = readFileSync(await saved.path(), "utf8")
    .trim()
    .split("\n");
  const values = lines.filter((line) => !line.startsWith("#"));
  expect(values[0]).toBe("time_s,bank.c00 (V),bank.c01 (V)");
  const rows = values.slice(1).map((line) => line.split(",").map(Number) as [number, number, number]);
  const zero = Number(/0 is at ([\d.]+) s/.exec((await page.getByTestId("axis").textContent()) ?? "")?.[1]);
  const before = rows.filter(([time]) => time < zero);
  expect(before.length).toBeGreaterThan(0);
  expect(before.at(-1)?.[1]).toBeLessThan(0.5);
  expect(rows.find(([time]) => time > zero)?.[1]).toBeGreaterThanOrEqual(0.5);
  await shoot(page, "scope-trigger");
});

test("no axis has two equal labels, however closely a large value is looked at", async () => {
  const { page } = studio;
  await page.evaluate(() => {
    const texts: string[] = [];
    const write = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
      texts.push(String(text));
      write.call(this, text, x, y);
    };
    Object.assign(window, { texts });
    const setup = {
      traces: [{ channel: "bank.c00", component: "", look: 0, range: [1234.5678, 1234.5682] }],
      sweep: "roll",
      span_s: 0.5,
    };
    window.location.hash = `#/scope?setup=${encodeURIComponent(JSON.stringify(setup))}`;
  });
  const texts = () => page.evaluate(() => (window as unknown as { texts: string[] }).texts);
  // Each of these would otherwise read 1234.6.
  await until("the labels have the digits that they need", async () => (await texts()).includes("×10⁻³ + 1234.567"));
  expect(await texts()).toEqual(expect.arrayContaining(["0.80", "0.85", "0.90", "0.95", "1.00", "1.05", "1.10", "1.15", "1.20"]));
  await shoot(page, "scope-labels");
});

test("after a zoom, *Time* shows the span that is chosen, also if it is the one from before the zoom", async () => {
  const { page } = studio;
  await commander.start("waves").catch(() => undefined);
  await page.evaluate(() => {
    const setup = { traces: [{ channel: "bank.c00", component: "", look: 0 }], sweep: "roll", span_s: 2 };
    window.location.hash = `#/scope?setup=${encodeURIComponent(JSON.stringify(setup))}`;
  });
  const tools = page.getByRole("toolbar", { name: "Scope" });
  const time = tools.getByRole("combobox", { name: "Time", exact: true });
  await expect.poll(() => time.inputValue()).toBe("2");
  await until("values are drawn", async () => /\d/.test((await page.getByTestId("axis").textContent()) ?? ""));
  await tools.getByRole("button", { name: "Stop", exact: true }).click();
  const screen = page.getByRole("group", { name: /^Screen/ });
  for (const _ of [1, 2]) {
    const before = await time.inputValue();
    await screen.focus();
    await page.keyboard.press("+");
    await expect.poll(() => time.inputValue()).not.toBe(before);
    await time.selectOption("5");
    await expect.poll(() => time.inputValue()).toBe("5");
  }
  await tools.getByRole("button", { name: "Run", exact: true }).click();
});

test("a value is found by a few keys", async () => {
  const { page } = studio;
  await page.locator("body").click({ position: { x: 2, y: 2 } });
  await page.keyboard.press("/");
  await page.keyboard.type("c42");
  await page.keyboard.press("Enter");
  await page.locator('tr[data-trace="bank.c42"]').waitFor();
});

test("lanes keep the names of their traces, however many there are and however narrow the window is", async () => {
  const { page } = studio;
  // A trace without a value has no lane; the test of the trigger has started the values if it has run.
  await commander.start("waves").catch(() => undefined);
  await page.evaluate((names) => {
    const traces = names.map((channel, look) => ({ channel, component: "", look }));
    window.location.hash = `#/scope?setup=${encodeURIComponent(JSON.stringify({ traces, scales: "lanes", sweep: "roll", span_s: 2 }))}`;
  }, CHANNELS);
  await page.getByText(/^64 channels/).waitFor();
  // Several workers run; one of them draws.
  for (const worker of page.workers())
    await worker.evaluate(() => {
      const texts = new Set<string>();
      const write = OffscreenCanvasRenderingContext2D.prototype.fillText;
      OffscreenCanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
        texts.add(String(text).split("  ")[0] ?? "");
        write.call(this, text, x, y);
      };
      Object.assign(self, { texts });
    });
  type Drawing = { texts: Set<string> };
  const forget = () => Promise.all(page.workers().map((one) => one.evaluate(() => (self as unknown as Drawing).texts.clear())));
  const drawn = () => Promise.all(page.workers().map((one) => one.evaluate(() => [...(self as unknown as Drawing).texts])));
  const named = async () => (await drawn()).flat();
  for (const width of [1440, 800, 390]) {
    await page.setViewportSize({ width, height: 900 });
    await forget();
    await until("each lane has its name", async () => (await named()).length >= 64);
    expect(await named()).toEqual(expect.arrayContaining(CHANNELS));
    // The last lane is reached by scrolling.
    const plot = page.locator(".plot");
    await plot.evaluate((one) => one.scrollIntoView({ block: "end" }));
    await shoot(page, `scope-lanes-${width}`);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
});

test("nothing is wrong for who uses keys or a screen reader, light or dark, wide or narrow", async () => {
  const { page, errors } = studio;
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    await shoot(page, `scope-${look.width}-${look.scheme}`);
  }
  expect(errors).toEqual([]);
});
