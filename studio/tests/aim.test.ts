// SPDX-License-Identifier: Apache-2.0
// Random presses while messages appear and disappear: each commanding press hits the control that was under the finger 100 ms before, or is
// refused.
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test, vi } from "vitest";
import { Commander } from "./commander";
import { randomOf } from "./randomActions";
import { browse, goTo, type Opened, open, pressFreely, type Running, run, shoot } from "./running";

/** Number of presses at each width. */
const PRESSES = Number(process.env.OPENGPAC_PRESSES ?? 40);
const SEED = Number(process.env.OPENGPAC_SEED ?? 1);

let running: Running;
let browser: Browser;
let studio: Opened;
let other: Commander;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "program.py"), "--role", "configure"), browse(false)]);
  studio = await open(browser, running.url);
  pressFreely(studio.page);
  other = await Commander.open(running.url, true);
  // The page is served before the program has started its motions, which would count as starts of the page.
  await vi.waitFor(
    async () => expect((await other.instances()).filter((one) => one.verb === "sway" && one.state === "running")).toHaveLength(2),
    { timeout: 90_000 },
  );
  await other.call("define_alarm", { code: "E7", text: "oil is low", remedy: "refill it", severity: "high" });
});

afterAll(async () => {
  await other?.close();
  await browser?.close();
  await running?.stop();
});

interface Target {
  x: number;
  y: number;
}

/** Returns a visible control and its centre; `null` if it is covered by something else. */
async function aimed(page: Page, part: number): Promise<Target | null> {
  return await page.evaluate((part) => {
    const seen = [...document.querySelectorAll<HTMLElement>("button, a[href], input, select, summary")].flatMap((control) => {
      const box = control.getBoundingClientRect();
      const at = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
      const there = document.elementFromPoint(at.x, at.y);
      if (!there?.closest("button, a[href], input, select, summary")?.isSameNode(control)) return [];
      return [at];
    });
    return seen[Math.floor(part * seen.length)] ?? null;
  }, part);
}

/**
 * A press that reached a control: its name, whether it commands, and the controls at that point when it was aimed at, 100 to 250 ms
 * before.
 */
interface Hit {
  name: string;
  commands: boolean;
  before: string[];
}

/** Records presses and suppresses their effect. Also records, in each frame, the control at the aimed point. */
async function takeDown(page: Page): Promise<void> {
  await page.evaluate(() => {
    const taken = window as unknown as { hit: Hit[]; aim: { x: number; y: number }; seen: { time: number; name: string }[] };
    taken.hit = [];
    taken.aim = { x: 0, y: 0 };
    taken.seen = [];
    const at = (control: Element | null | undefined) =>
      control ? `${control.tagName} ${control.getAttribute("aria-label") ?? control.textContent}` : "nothing";
    const controls = "button, a[href], input, select, summary";
    const look = () => {
      const { seen, aim } = taken;
      seen.push({ time: performance.now(), name: at(document.elementFromPoint(aim.x, aim.y)?.closest(controls)) });
      if (seen.length > 100) seen.shift();
      requestAnimationFrame(look);
    };
    look();
    const keep = (event: Event) => {
      const control = (event.target as Element).closest(controls);
      if (control && event.type === "pointerdown") {
        const { seen } = taken;
        const since = seen.findLastIndex((one) => one.time <= event.timeStamp - 250);
        const before = seen.slice(Math.max(0, since)).filter((one) => one.time <= event.timeStamp - 100);
        taken.hit.push({ name: at(control), commands: control.closest("[data-commands]") !== null, before: before.map((one) => one.name) });
      }
      event.preventDefault();
      event.stopPropagation();
    };
    for (const name of ["pointerdown", "pointerup", "mousedown", "mouseup", "click"]) document.addEventListener(name, keep, true);
  });
}

/** Aims at a point. Forgets observations of other points, and returns after the first one of this point. */
async function aim(page: Page, at: Target): Promise<void> {
  await page.evaluate((at) => {
    const taken = window as unknown as { aim: Target; seen: unknown[] };
    taken.aim = at;
    taken.seen = [];
    return new Promise<void>((done) => {
      const look = () => (taken.seen.length > 0 ? done() : requestAnimationFrame(look));
      look();
    });
  }, at);
}

/** Causes an event in the system that the page shows. */
async function happens(kind: number): Promise<void> {
  const known = () => undefined;
  if (kind < 0.3)
    await other.call("raise_alarm", { code: "E7", source: `press ${Math.floor(kind * 10)}`, text: "oil is low" }).catch(known);
  else if (kind < 0.5) await other.call("clear_alarm", { code: "E7", source: `press ${Math.floor((kind - 0.3) * 10)}` }).catch(known);
  else if (kind < 0.6) await other.call("acknowledge_alarms", {}).catch(known);
  else if (kind < 0.75) await other.call("emergency_stop", { reason: "somebody saw something" }).catch(known);
  else if (kind < 0.9) await other.call("reset", {}).catch(known);
  else await other.call("enable", { name: "wrist_3" }).catch(known);
}

test("a press that follows a release at once jogs: it waits for its own halt", async () => {
  const { page } = studio;
  await other.giveBack();
  await goTo(page, "Devices");
  const before = await other.starts();
  const box = await page.getByRole("button", { name: "Jog wrist_3 forward while held" }).boundingBox();
  if (!box) throw new Error("there is no button to jog with");
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await expect.poll(() => other.starts()).toBe(before + 1);
  await page.mouse.up();
  await page.mouse.down();
  await expect.poll(() => other.starts()).toBe(before + 2);
  const jogs = async () => (await other.instances()).filter((one) => one.verb === "jog" && one.state === "running").length;
  await expect.poll(jogs).toBe(1);
  await page.mouse.up();
  await expect.poll(jogs).toBe(0);
  await other.take(true);
});

test.each([390, 800, 1440])(
  "at %i pixels each press hits what was aimed at, or is refused",
  { timeout: 400_000 + PRESSES * 5_000 },
  async (width) => {
    const { page, errors } = studio;
    await page.setViewportSize({ width, height: 900 });
    await page.reload();
    await goTo(page, "Devices");
    await page.getByRole("button", { name: "Jog wrist_3 forward while held" }).waitFor();
    // Controls folded in narrow windows are pressed too.
    const fold = page.getByRole("button", { name: "More: command, mode and clock" });
    if (await fold.isVisible()) await fold.click();
    await takeDown(page);
    const random = randomOf(SEED * 1000 + width);
    let [refused, commanding, changed] = [0, 0, 0];
    for (let index = 0; index < PRESSES; index += 1) {
      const target = await aimed(page, random());
      if (!target) continue;
      await aim(page, target);
      const happened = happens(random());
      await page.waitForTimeout(100 + 300 * random());
      await page.mouse.click(target.x, target.y);
      await happened;
      const [hit] = await page.evaluate(() => (window as unknown as { hit: Hit[] }).hit.splice(0));
      if (!hit) refused += 1;
      else if (hit.commands) expect(hit.before, `seed ${SEED}, press ${index}`).toContain(hit.name);
      else if (!hit.before.includes(hit.name)) changed += 1;
      if (hit?.commands) commanding += 1;
    }
    process.stdout.write(
      `at ${width} pixels: ${PRESSES} presses, ${refused} refused or on nothing, ${commanding} on what commands, ` +
        `${changed} on another control that commands nothing\n`,
    );
    expect(commanding).toBeGreaterThan(PRESSES / 10);
    // Most presses reach their target: nothing moves.
    expect(refused).toBeLessThan(PRESSES / 5);
    await shoot(page, `messages-${width}`);
    expect(errors).toEqual([]);
  },
);
