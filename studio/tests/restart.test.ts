// SPDX-License-Identifier: Apache-2.0
// A daemon that is killed and restarted under an open page: no data of the earlier run is shown as current.
import type { ChildProcess } from "node:child_process";
import { mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { freePort, serve, tokenIn } from "./daemon";
import { axeFindings, browse, goTo, type Opened, open, STOP, shoot, stopRectangles } from "./running";

let folder: string;
let port: number;
let token: string;
let daemon: ChildProcess | undefined;
let browser: Browser;
let studio: Opened;

/** Starts the daemon; resolves when it listens. */
const start = () => serve(folder, port, "--audit", join(folder, "audit.jsonl"));

function killed(process_: ChildProcess | undefined): Promise<void> {
  return new Promise((gone) => {
    if (!process_ || process_.exitCode !== null || process_.signalCode !== null) return gone();
    process_.once("exit", () => gone());
    process_.kill("SIGKILL");
  });
}

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), "studio-"));
  [token, port] = [tokenIn(folder), await freePort()];
  [daemon, browser] = await Promise.all([start(), browse(false)]);
  studio = await open(browser, `http://127.0.0.1:${port}/#token=${token}`);
});

afterAll(async () => {
  await browser?.close();
  await killed(daemon);
  rmSync(folder, { recursive: true, force: true });
});

test("a recording is begun from the page, seen to grow, and stopped", async () => {
  const { page, errors } = studio;
  await goTo(page, "Recordings");
  // The page must add the extension: a file without it would not be listed, and could not be stopped.
  await page.getByLabel("File").fill("run");
  await page.getByText("is run.mcap, in the system's folder").waitFor();
  await page.getByRole("button", { name: "Record", exact: true }).click();
  const row = page.locator("tr").filter({ has: page.getByRole("rowheader", { name: "run.mcap" }) });
  await row.getByText("records", { exact: true }).waitFor();
  await row.getByRole("button", { name: "Stop" }).click();
  await row.getByText("complete").waitFor();
  expect(await row.locator("td.number").last().textContent()).toMatch(/[1-9].* (B|KiB|MiB)$/);
  expect(statSync(join(folder, "run.mcap")).size).toBeGreaterThan(0);
  // A name with a folder in it is refused, and the system's message appears next to the button.
  await page.getByLabel("File").fill("no/such.mcap");
  await page.getByRole("button", { name: "Record", exact: true }).click();
  await page.getByText("a recording cannot be named").waitFor();
  expect(await axeFindings(page)).toEqual([]);
  for (const width of [1440, 800, 390]) {
    await page.setViewportSize({ width, height: 900 });
    await shoot(page, `recordings-${width}`);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  expect(errors).toEqual([]);
});

test("every running recording is listed with the free space of its disk, and can be stopped", async () => {
  const { page, errors } = studio;
  await goTo(page, "Recordings");
  const row = (name: string) => page.locator("tr").filter({ has: page.getByRole("rowheader", { name: `${name}.mcap` }) });
  for (const name of ["first", "second"]) {
    await page.getByLabel("File").fill(name);
    await page.getByRole("button", { name: "Record", exact: true }).click();
    await row(name).getByText("records", { exact: true }).waitFor();
  }
  for (const name of ["first", "second"])
    await expect.poll(() => row(name).getByText("records", { exact: true }).getAttribute("title")).toMatch(/^[1-9].* free on its disk$/);
  for (const name of ["first", "second"]) {
    await row(name).getByRole("button", { name: "Stop" }).click();
    await row(name).getByText("complete").waitFor();
  }
  expect(errors).toEqual([]);
});

test("what the log has of the earlier run says so, and the new run's entries come", async () => {
  const { page } = studio;
  await goTo(page, "Log");
  await page.locator(".line").filter({ hasText: "command list 'on'" }).first().waitFor();
  await page.locator(".line").nth(6).waitFor();
  await killed(daemon);
  await page.getByText("No connection.").waitFor();
  expect(await stopRectangles(page), "the daemon is gone").toEqual([STOP]);
  daemon = await start();
  await page.getByText("The system was restarted.").waitFor();
  expect(await stopRectangles(page), "started again").toEqual([STOP]);
  await page.locator(".line:not(.earlier)").filter({ hasText: "command list 'on'" }).first().waitFor();
  await page.locator(".lines").evaluate((lines) => {
    lines.scrollTop = 0;
  });
  const earlier = page.locator(".line.earlier");
  await earlier.first().waitFor();
  expect(await earlier.first().textContent()).toContain("earlier run");
  // All lines of the earlier run precede those of the present one.
  const kinds = await page.locator(".line").evaluateAll((lines) => {
    const sorted = lines.sort(
      (one, other) => Number.parseFloat((one as HTMLElement).style.top) - Number.parseFloat((other as HTMLElement).style.top),
    );
    return sorted.map((line) => (line.classList.contains("earlier") ? "e" : "p")).join("");
  });
  expect(kinds).toMatch(/^e+p*$/);
  await shoot(page, "log-restarted");
});

test("the history of an instance is of the present run alone", async () => {
  const { page, errors } = studio;
  await goTo(page, "Verbs");
  await page.locator(".history tbody tr").first().waitFor();
  const seconds = async (selector: string) =>
    (await page.locator(selector).allTextContents()).map((text) => Number.parseFloat(text)).filter((time) => !Number.isNaN(time));
  const times = await seconds(".history tbody td.number");
  const [now] = await seconds(".bar .clock .figures");
  expect(times.length).toBeGreaterThan(0);
  expect(Math.max(...times)).toBeLessThanOrEqual((now ?? 0) + 1);
  expect([...times].sort((a, b) => b - a)).toEqual(times);
  // Requests that failed while nothing answered are not errors of the page.
  expect(errors.filter((error) => !/ERR_CONNECTION|WebSocket|Failed to load resource/.test(error))).toEqual([]);
});
