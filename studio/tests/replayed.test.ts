// SPDX-License-Identifier: Apache-2.0
// A recording is replayed from the page: equal runs are reported, and the first difference is marked on the axis. Also its spectra and
// plots.
import type { ChildProcess } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { freePort, serveProgram, tokenIn } from "./daemon";
import { axeFindings, browse, goTo, LOOKS, type Opened, open, shoot, standsStill } from "./running";

let folder: string;
let daemon: ChildProcess | undefined;
let browser: Browser;
let studio: Opened;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), "studio-replayed-"));
  const [token, port] = [tokenIn(folder), await freePort()];
  const program = join(import.meta.dirname, "replayed.py");
  [daemon, browser] = await Promise.all([serveProgram([program, folder], folder, port), browse(false)]);
  studio = await open(browser, `http://127.0.0.1:${port}/#token=${token}`);
});

afterAll(async () => {
  await browser?.close();
  daemon?.kill("SIGKILL");
  rmSync(folder, { recursive: true, force: true });
});

test("equal runs say so, and the first difference of other code is marked on the axis", async () => {
  const { page } = studio;
  await goTo(page, "Recordings");
  await page.locator("tr").filter({ hasText: "run.mcap" }).getByRole("button", { name: "Open" }).click();
  const replay = page.getByRole("group", { name: "Replay" });
  await replay.getByRole("button", { name: "Replay" }).click();
  await replay.getByText("all values equal to the recorded ones").waitFor();
  expect(await page.getByTestId("difference").count()).toBe(0);
  await replay.getByLabel("with present code").check();
  await replay.getByRole("button", { name: "Replay" }).click();
  await replay.getByText("first difference").waitFor();
  expect(await replay.getByRole("status").textContent()).toContain("bench.n: recorded 1000, now 1001");
  // Half of the 2 s, on the slider; a press moves the cursor there.
  const [slider, mark] = [await page.getByLabel("Time in the recording").boundingBox(), await page.getByTestId("difference").boundingBox()];
  expect(((mark?.x ?? 0) + 1.5 - (slider?.x ?? 0)) / (slider?.width ?? 1)).toBeCloseTo(0.5, 1);
  await replay.getByRole("status").getByRole("button").click();
  expect(Number.parseFloat((await page.getByTestId("cursor").textContent()) ?? "")).toBeCloseTo(1, 2);
  await replay.getByRole("link", { name: "bench.n" }).click();
  await page.locator(".difference-mark:not([hidden])").first().waitFor();
});

test("traces in two plots have one time axis, and the spectrum has the frequency and amplitude of the sine", async () => {
  const { page } = studio;
  await page.evaluate(() => {
    window.location.hash = "#/scope?names=bench.n,bench.y";
  });
  const tools = page.getByRole("toolbar", { name: "Scope" });
  const cell = (name: string) => page.locator(`tr[data-trace="bench.y"] [data-cell="${name}"]`);
  await expect.poll(async () => Number(await cell("deviation").textContent())).toBeCloseTo(0.5 / Math.SQRT2, 2);
  expect(((await cell("count").textContent()) ?? "").replace(/\D/g, "")).toMatch(/^200[01]$/);
  await page.getByRole("button", { name: "More for bench.y" }).click();
  await page.getByLabel("Plot", { exact: true }).selectOption({ label: "2" });
  await expect.poll(() => page.locator(".one-plot").count()).toBe(2);
  // They are rebuilt when the second one appears.
  const [upper, lower] = [page.locator('[data-plot="1"] .u-over'), page.locator('[data-plot="2"] .u-over')];
  const wide = async (over: typeof upper) => {
    const box = await over.boundingBox();
    return box && [box.x, box.width];
  };
  await expect
    .poll(async () => {
      const [above, below] = [await wide(upper), await wide(lower)];
      return above !== null && JSON.stringify(above) === JSON.stringify(below);
    })
    .toBe(true);
  await shoot(page, "scope-plots");
  await tools.getByLabel("X axis").selectOption("frequency");
  await tools.getByLabel("Window").selectOption("flat top");
  await expect.poll(async () => Number(await cell("hz").textContent())).toBeCloseTo(50, 0);
  // Until it is recomputed, the table shows the values of the previous window.
  await expect.poll(async () => Number(await cell("peak").textContent())).toBeCloseTo(0.5, 2);
  await page.getByTestId("axis").getByText("at 1000 Hz").waitFor();
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    await shoot(page, `scope-spectrum-${look.width}-${look.scheme}`);
    const wide = () => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    await expect.poll(wide, { message: `wider than ${look.width} pixels` }).toBeLessThanOrEqual(0);
  }
  // Zoomed in with the keyboard and by drag, and back; the file contains the visible range.
  await page.setViewportSize({ width: 1440, height: 900 });
  const screen = page.getByRole("group", { name: /^Screen\./ });
  await screen.focus();
  await page.keyboard.press("+");
  await expect.poll(async () => Number(await tools.getByLabel("From").inputValue())).toBeCloseTo(50, 3);
  await expect.poll(async () => Number(await tools.getByLabel("Up to").inputValue())).toBeCloseTo(450, 3);
  await tools.getByLabel("From").fill("0");
  await tools.getByLabel("From").press("Enter");
  // The labels of the axis have another width after the change.
  await standsStill(page.locator('[data-plot="2"] .u-over'));
  const box = await page.locator('[data-plot="2"] .u-over').boundingBox();
  if (!box) throw new Error("the second plot is to be seen");
  const at = (hz: number) => box.x + (hz / 450) * box.width;
  await page.mouse.move(at(30), box.y + 20);
  await page.mouse.down();
  await page.mouse.move(at(70), box.y + 30, { steps: 5 });
  await page.mouse.up();
  await expect.poll(async () => Number(await tools.getByLabel("Up to").inputValue())).toBeCloseTo(70, 0);
  expect(Number(await tools.getByLabel("From").inputValue())).toBeCloseTo(30, 0);
  expect(Number(await cell("hz").textContent())).toBeCloseTo(50, 0);
  const coming = page.waitForEvent("download");
  await tools.getByRole("button", { name: "SVG", exact: true }).click();
  const svg = readFileSync(await (await coming).path(), "utf8");
  expect([...svg.matchAll(/<path /g)]).toHaveLength(2);
  expect(svg).toContain(">Hz<");
  await shoot(page, "scope-spectrum-closer");
  await tools.getByRole("button", { name: "All frequencies" }).click();
  await expect.poll(() => tools.getByLabel("Up to").inputValue()).toBe("0");
  expect(studio.errors).toEqual([]);
});
