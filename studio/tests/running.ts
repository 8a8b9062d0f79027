// SPDX-License-Identifier: Apache-2.0
// A running system with its page, and a browser that views it.
import { type ChildProcess, spawn } from "node:child_process";
import { copyFileSync, existsSync, mkdirSync, mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import axe from "axe-core";
import { type Browser, type BrowserContext, chromium, type Locator, type Page } from "playwright-core";
import { afterEach, expect } from "vitest";

export const ROOT = resolve(import.meta.dirname, "../..");
/** Folder of the screenshots. */
export const OUT = join(ROOT, "out/studio");
/** Folder of the served page. */
export const BUILT = join(ROOT, "python/opengpac/studio_page");
export const PYTHON = process.env.OPENGPAC_PYTHON ?? join(ROOT, ".venv/bin/python");
/** Recordings without a named folder go to the test's own. */
const DATA = mkdtempSync(join(tmpdir(), "opengpac-studio-"));
export const SURROUNDINGS = {
  ...process.env,
  PYTHONPATH: process.env.PYTHONPATH ?? join(ROOT, "python"),
  PYTHONUNBUFFERED: "1",
  XDG_DATA_HOME: DATA,
};
/** Limit of any wait, ms: test machines are slow. */
export const PATIENCE_MS = Number(process.env.OPENGPAC_PATIENCE_MS ?? 90_000);

export interface Running {
  /** Address of the page, with its token. */
  url: string;
  /** Returns the output of the program and the system. */
  said: () => string;
  stop: () => Promise<void>;
}

/** Runs a program with `opengpac studio`; resolves when its page is served. */
export function run(program: string, ...options: string[]): Promise<Running> {
  const command = ["-m", "opengpac", "studio", "--no-browser", "--page", BUILT, ...options, program];
  const process_ = spawn(PYTHON, command, { env: SURROUNDINGS });
  let text = "";
  return new Promise((found, failed) => {
    const hear = (chunk: Buffer) => {
      text += chunk.toString();
      const url = /^studio: (http\S+)$/m.exec(text)?.[1];
      if (url) found({ url, said: () => text, stop: () => stop(process_) });
    };
    process_.stdout.on("data", hear);
    process_.stderr.on("data", hear);
    process_.once("exit", (code) => failed(new Error(`opengpac studio ended with ${code}:\n${text}`)));
    process_.once("error", failed);
  });
}

function stop(process_: ChildProcess): Promise<void> {
  return new Promise((ended) => {
    if (process_.exitCode !== null) return ended();
    process_.once("exit", () => ended());
    process_.kill("SIGINT");
  });
}

/** Starts a browser. `graphics` enables software rendering, which 3-D needs; everything else is several times faster without it. */
export async function browse(graphics = true): Promise<Browser> {
  const fetched = new URL("../../.venv/browser/chromium", import.meta.url).pathname;
  const known = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome", fetched];
  const executablePath = known.find((path) => path !== undefined && existsSync(path));
  if (!executablePath) throw new Error("there is no browser: install Debian's chromium, or name one with CHROMIUM=");
  // The sandbox needs privileges that containers lack and does not work as root; rendering is in software, as there is no graphics card.
  return await chromium.launch({
    executablePath,
    args: ["--no-sandbox", ...(graphics ? ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"] : ["--disable-gpu"])],
  });
}

/** A page of the studio, with the errors that occurred in it. */
export interface Opened {
  page: Page;
  context: BrowserContext;
  /** Console errors and uncaught exceptions. */
  errors: string[];
}

export interface Look {
  width: number;
  height: number;
  scheme: "light" | "dark";
}

export const LOOKS: Look[] = [
  { width: 1440, height: 900, scheme: "light" },
  { width: 1440, height: 900, scheme: "dark" },
  { width: 800, height: 1000, scheme: "light" },
  { width: 800, height: 1000, scheme: "dark" },
  { width: 390, height: 844, scheme: "light" },
];

/** Opens a page of the studio in a browser of a language, and waits until it shows that it is `live`. */
export async function open(
  browser: Browser,
  url: string,
  look: Look = LOOKS[0] as Look,
  { locale, live } = { locale: "en-US", live: "live" },
): Promise<Opened> {
  const context = await browser.newContext({ viewport: { width: look.width, height: look.height }, colorScheme: look.scheme, locale });
  context.setDefaultTimeout(PATIENCE_MS);
  await context.exposeBinding("tellUnaimed", ({ page }, name: string) => void (pressingFreely.has(page) || unaimed.push(name)));
  await context.addInitScript(watchForUnaimed);
  const page = await context.newPage();
  const errors: string[] = [];
  page.on("console", (message) => {
    // The browser reports each refused call and request for command: the page shows the refusal in place, so this is not an error.
    const isRefused = /\/v1\/(call\/|command$)/.test(message.location().url) && message.text().startsWith("Failed to load resource");
    if (message.type() === "error" && !isRefused) errors.push(`${message.text()} (${message.location().url})`);
  });
  page.on("pageerror", (error) => errors.push(error.message));
  await page.goto(url);
  await page.getByText(live, { exact: true }).waitFor();
  return { page, context, errors };
}

export async function goTo(page: Page, view: string): Promise<void> {
  await page.getByRole("navigation", { name: "Views" }).getByRole("link", { name: view, exact: true }).click();
  await page.getByRole("main", { name: view }).waitFor();
}

/** Pictures of the docs, by the names of screenshots; updated with OPENGPAC_WRITE_PICTURES=1. */
const PICTURES: Record<string, string> = { "verbs-1440-light": "studio-verbs", "scope-trigger": "studio-scope" };

export async function shoot(page: Page, name: string): Promise<void> {
  mkdirSync(OUT, { recursive: true });
  const shot = join(OUT, `${name}.png`);
  await page.screenshot({ path: shot });
  const picture = PICTURES[name];
  if (picture && process.env.OPENGPAC_WRITE_PICTURES) copyFileSync(shot, join(ROOT, "docs/pictures", `${picture}.png`));
}

/** Returns a description of each violation that axe finds; `isEnhanced` also requires a contrast of 7 rather than 4.5. */
export async function axeFindings(page: Page, isEnhanced = false): Promise<string[]> {
  if (!(await page.evaluate(() => "axe" in window))) await page.evaluate(axe.source);
  const found = await page.evaluate(async (enabled) => {
    const options = { resultTypes: ["violations" as const], rules: { "color-contrast-enhanced": { enabled } } };
    const checked = await (window as unknown as { axe: typeof axe }).axe.run(document, options);
    return checked.violations.map((one) => ({
      id: one.id,
      help: one.help,
      where: one.nodes.map((node) => `${node.target} ${node.failureSummary}`),
    }));
  }, isEnhanced);
  return found.map((one) => `${one.id}: ${one.help}: ${one.where.join(" | ")}`);
}

/** Time that a control stands still before a person presses it, ms. */
const AIMED_MS = 200;

/** Names of commanding controls that a test pressed without aiming: the page may refuse such a press on a slow machine. */
const unaimed: string[] = [];
/** Pages whose test presses any control at any time, and expects refusals. */
const pressingFreely = new WeakSet<Page>();

afterEach(() => {
  expect(unaimed.splice(0), "controls that command are pressed with `command`, or after `standsStill`").toEqual([]);
});

/** Lets a test press any control of a page without aiming first. */
export function pressFreely(page: Page): void {
  pressingFreely.add(page);
}

/** Runs in the page, before its own scripts: reports each press of a commanding control that was not aimed at. */
function watchForUnaimed(): void {
  const told = window as unknown as { aimed?: string; tellUnaimed: (name: string) => void };
  const press = (event: PointerEvent) => {
    const control = event.target instanceof Element ? event.target.closest("button") : null;
    if (event.button !== 0 || !control?.closest("[data-commands]") || control.textContent === told.aimed) return;
    told.tellUnaimed(control.getAttribute("aria-label") ?? control.textContent ?? "");
  };
  window.addEventListener("pointerdown", press, true);
}

/**
 * Presses a commanding control as a person does: after it stands still, and again if the page reports that the press was too late or
 * that something else was there when it was aimed at. Waits for the result.
 */
export async function command(control: Locator, led: Locator, state: "visible" | "detached" = "visible"): Promise<void> {
  const page = control.page();
  const told = page.getByText(/after it was issued|Press again/);
  // A second refused press has the same message as the first, so its number is compared too.
  const saidNow = async () =>
    [...(await told.allTextContents()), ...(await page.locator(".toast").evaluateAll((all) => all.map((one) => one.dataset.count)))].join(
      "; ",
    );
  const isLed = async () => (await led.first().isVisible()) === (state === "visible");
  const until = performance.now() + PATIENCE_MS;
  let said = "";
  for (let isPressed = false; !(isPressed && (await isLed())); ) {
    const now = await saidNow();
    if (!isPressed || (now !== said && now !== "")) {
      await standsStill(control);
      await control.click();
      isPressed = true;
    }
    said = now;
    if (performance.now() > until) throw new Error(`'${control}' was pressed and did not lead to '${led}': ${said}`);
    await page.waitForTimeout(20);
  }
}

/** Waits until an element has kept its position for as long as a person aims. */
export async function standsStill(element: Locator): Promise<void> {
  await element.evaluate(standStill, AIMED_MS);
}

/** Runs in the page: resolves when the element has stood still for this time. */
function standStill(element: Element, for_ms: number): Promise<void> {
  return new Promise((over) => {
    let place = "";
    let since = performance.now();
    const look = (): unknown => {
      const now = JSON.stringify(element.getBoundingClientRect());
      if (now !== place) since = performance.now();
      place = now;
      if (performance.now() - since < for_ms) return requestAnimationFrame(look);
      (window as unknown as { aimed: string | null }).aimed = element.textContent;
      over();
    };
    look();
  });
}

/** Window widths, from the narrowest to the widest. */
const WIDTHS = [360, 390, 800, 1000, 1280, 1440, 1920];

/** Rectangle of the emergency stop in every view, state and width; nothing may be wider than the window. */
export const STOP = JSON.stringify({ x: 8, y: 4, width: 140, height: 44 });

/** Rectangles on an operator's panel, where the stop begins at the same point and is the largest control: narrow, middle, wide. */
export const PANEL_STOPS = [
  [152, 94],
  [200, 94],
  [200, 102],
].map(([width, height]) => JSON.stringify({ x: 8, y: 4, width, height }));

/**
 * Returns the distinct rectangles of the emergency stop over all widths of the present page: each must be STOP. Also reports content
 * wider than the window.
 */
export async function stopRectangles(page: Page): Promise<string[]> {
  const before = page.viewportSize();
  const found = new Set<string>();
  for (const width of WIDTHS) {
    await page.setViewportSize({ width, height: 900 });
    const box = await page.getByRole("button", { name: "Emergency stop" }).boundingBox();
    found.add(JSON.stringify(box));
    const beyond = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    if (beyond > 0) found.add(`${beyond} pixels wider than ${width}`);
  }
  if (before) await page.setViewportSize(before);
  return [...found];
}

/** Waits until a text has changed; returns both texts. */
export async function changes(page: Page, selector: string): Promise<[string, string]> {
  const element = page.locator(selector).first();
  await element.waitFor();
  const handle = await element.elementHandle();
  if (!handle) throw new Error(`there is no ${selector}`);
  await page.waitForFunction((shown) => shown.textContent !== "–", handle);
  const before = (await handle.textContent()) ?? "";
  await page.waitForFunction(([shown, was]) => (shown as Element).textContent !== was, [handle, before] as const);
  return [before, (await handle.textContent()) ?? ""];
}

/** Opens a view by its address, even one without a navigation link. */
export async function show(page: Page, address: string): Promise<void> {
  await page.evaluate((hash) => {
    window.location.hash = hash;
  }, address);
}
