// SPDX-License-Identifier: Apache-2.0
// Presses of a button that moves a machine, over a network that freezes, delays, drops and cuts at random: no move begins later than half a
// second after its press. Part of `make faults`.
import { join } from "node:path";
import { expect, test } from "vitest";
import { Commander } from "../commander";
import { Link } from "../link";
import { randomOf } from "../randomActions";
import { browse, open, run, show } from "../running";

const PRESSES = Number(process.env.OPENGPAC_LATE ?? 300);
const SEED = Number(process.env.OPENGPAC_SEED ?? 1);
/** Maximum age of a command on arrival, ms; the constant below is the time that the system may take to begin an accepted one. */
const OLD_MS = 500;
const BEGINS_MS = 50;

test(`${PRESSES} presses over a bad network: no move begins ${OLD_MS} ms after its press`, {
  timeout: 120_000 + PRESSES * 15_000,
}, async () => {
  const [running, browser] = await Promise.all([run(join(import.meta.dirname, "real_people.py"), "--role", "configure"), browse(false)]);
  const link = await Link.to(Number(new URL(running.url).port));
  const watch = await Commander.look(running.url);
  const url = new URL(running.url);
  url.port = String(link.port);
  const { page } = await open(browser, url.href);
  await show(page, "#/panel/joint");
  const home = page.locator('[data-button="Home"]');
  const press = home.getByRole("button", { name: "Home", exact: true });
  await press.waitFor();
  const box = await press.boundingBox();
  if (!box) throw new Error("there is no button");
  const at = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  await page.evaluate(() =>
    document.addEventListener("pointerdown", () => Object.assign(window, { pressed_ms: Date.now() }), { capture: true }),
  );
  const random = randomOf(SEED);
  const isHeard = () => page.locator('.shell[data-heard="yes"]').waitFor();
  const ways: [string, (ms: number) => void, () => void][] = [
    ["freezes", () => link.freeze(), () => link.thaw()],
    ["delays", (ms) => link.delay(ms), () => link.delay(0)],
    ["drops", () => link.drop(true), () => link.drop(false)],
    ["is cut", () => link.cut(), () => link.mend()],
    ["works", () => {}, () => {}],
  ];
  const done = { started: 0, refused: 0, latest_ms: 0 };
  for (let index = 0; index < PRESSES; index += 1) {
    const [how, begin, end] = ways[index % ways.length] as (typeof ways)[number];
    await isHeard();
    const before = (await watch.startsOf("home")).length;
    // The press occurs before, during or after the fault.
    const [lead_ms, lasts_ms] = [200 * random(), 2500 * random()];
    begin(50 + 900 * random());
    await page.waitForTimeout(lead_ms);
    // Offset of the system's clock from the page's: never too large, so that no press counts as later than it was.
    const system_ms = await watch.now_ms();
    const apart_ms = system_ms - Date.now();
    await page.mouse.click(at.x, at.y);
    const pressed_ms = apart_ms + (await page.evaluate(() => (window as unknown as { pressed_ms: number }).pressed_ms));
    await page.waitForTimeout(lasts_ms);
    end();
    await isHeard();
    // Everything in transit has arrived by now, or never will.
    await page.waitForTimeout(1500);
    const starts = (await watch.startsOf("home")).slice(before);
    expect(starts.length, `seed ${SEED}, press ${index}: the network ${how}`).toBeLessThanOrEqual(1);
    if (starts[0] === undefined) done.refused += 1;
    else {
      const late_ms = starts[0] - pressed_ms;
      expect(late_ms, `seed ${SEED}, press ${index}: the network ${how}`).toBeLessThanOrEqual(OLD_MS + BEGINS_MS);
      done.started += 1;
      done.latest_ms = Math.max(done.latest_ms, late_ms);
    }
  }
  process.stdout.write(
    `${PRESSES} presses: ${done.started} started, the latest after ${done.latest_ms.toFixed(0)} ms; ${done.refused} refused\n`,
  );
  await watch.close();
  await browser.close();
  link.close();
  await running.stop();
  expect(done.started).toBeGreaterThan(PRESSES / 10);
});
