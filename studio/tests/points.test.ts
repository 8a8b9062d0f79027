// SPDX-License-Identifier: Apache-2.0
// Taught points in the page: shown, taught, approached, renamed, deleted and restored, in the file that the program also reads and writes.
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { TaughtPoints } from "../src/control/shapes";
import { Commander } from "./commander";
import {
  axeFindings,
  browse,
  command,
  goTo,
  LOOKS,
  type Opened,
  open,
  type Running,
  run,
  STOP,
  shoot,
  standsStill,
  stopRectangles,
} from "./running";

let running: Running;
let browser: Browser;
let operator: Opened;
let watch: Commander;

beforeAll(async () => {
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "points.py")), browse(false)]);
  watch = await Commander.look(running.url);
  operator = await open(browser, running.url);
  await goTo(operator.page, "Devices");
});

afterAll(async () => {
  await watch?.close();
  await browser?.close();
  await running?.stop();
});

/** Path of the points file, as printed by the program. */
const file = () => /^points: (.*)$/m.exec(running.said())?.[1] ?? "";
const panel = (page: Page) => page.getByRole("region", { name: "Points of ur5e" });
const told = (page: Page) => panel(page).getByRole("status");
const row = (page: Page, name: string) =>
  panel(page)
    .getByRole("row")
    .filter({ has: page.getByRole("radio", { name, exact: true }) });
const button = (page: Page, name: string) => panel(page).getByRole("button", { name, exact: true });
const kept = async () => (await watch.call<TaughtPoints>("points", { arm: "ur5e" })).points;
const names = async () => (await kept()).map((point) => point.name);

async function joints(): Promise<number[]> {
  const all = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"];
  return await Promise.all(all.map((joint) => watch.value(`ur5e.${joint}.sensed`)));
}

/** Presses a control of the panel, and waits for the panel's message. */
async function press(page: Page, name: string, says: string | RegExp): Promise<void> {
  await command(button(page, name), told(page).getByText(says));
}

/** Turns a joint of the arm by jogging it: again where a busy machine let the jog end, since the page was not heard for 0.25 s. */
async function jog(page: Page): Promise<void> {
  const forward = page.getByRole("button", { name: "Jog wrist_3 forward while held" });
  const jogs = async () => (await watch.instances()).filter((one) => one.verb === "jog").length;
  const before = await watch.value("ur5e.wrist_3.sensed");
  const isTurned = async () => (await watch.value("ur5e.wrist_3.sensed")) - before > 0.05;
  while (!(await isTurned())) {
    const starts = await watch.starts();
    await standsStill(forward);
    await forward.hover();
    await page.mouse.down();
    await expect.poll(() => watch.starts()).toBeGreaterThan(starts);
    await expect.poll(async () => (await isTurned()) || (await jogs()) === 0).toBe(true);
    await page.mouse.up();
    await expect.poll(jogs).toBe(0);
  }
}

test("the points of the program's file stand there, with frame, tool, place and note", async () => {
  const { page } = operator;
  await row(page, "home").getByRole("cell", { name: "joints" }).waitFor();
  await row(page, "tray").getByRole("cell", { name: "table" }).waitFor();
  await row(page, "tray").getByText("above the tray").waitFor();
  // Both were taught at the same position.
  const [home, tray] = await Promise.all(["home", "tray"].map((name) => row(page, name).locator("td.number").textContent()));
  expect(home).toMatch(/^-?\d+\.\d, -?\d+\.\d, -?\d+\.\d$/);
  expect(tray).toBe(home);
  await panel(page)
    .getByText(file().split("/").at(-1) ?? "")
    .waitFor();
});

test("a point is taught where the arm stands, and the program's file has it", async () => {
  const { page } = operator;
  await jog(page);
  await panel(page).getByLabel("Name").fill("turned");
  await press(page, "Teach", "'turned' was taught at the present position.");
  const stands = await joints();
  const [turned] = (await kept()).filter((point) => point.name === "turned");
  for (const [index, joint] of stands.entries()) expect(turned?.joints[index]).toBeCloseTo(joint, 3);
  expect(readFileSync(file(), "utf8")).toMatch(/^turned = \{/m);
  await panel(page).getByLabel("Name").fill("in frame");
  await panel(page).getByLabel("Frame").selectOption("table");
  await panel(page).getByLabel("Tool").selectOption("gripper");
  await press(page, "Teach", "'in frame' was taught at the present position.");
  await row(page, "in frame").getByRole("cell", { name: "gripper" }).waitFor();
  const all = await kept();
  expect(readFileSync(file(), "utf8")).toMatch(/"in frame" = \{ frame = "table", tool = "gripper", position/);
  // The program has taught 'tray' in the same configuration of the arm.
  const [inFrame, tray] = ["in frame", "tray"].map((name) => all.find((point) => point.name === name));
  expect(tray?.configuration).toMatch(/^[+-]{3}$/);
  expect([inFrame?.configuration, inFrame?.turns]).toEqual([tray?.configuration, tray?.turns]);
});

test("the arm goes to a point by joints, and in a line", async () => {
  const { page } = operator;
  await row(page, "home").getByRole("radio").check();
  await press(page, "Move joints", "The arm is at 'home'.");
  const [home] = await kept();
  for (const [index, joint] of (await joints()).entries()) expect(joint).toBeCloseTo(home?.joints[index] ?? Number.NaN, 2);
  await row(page, "in frame").getByRole("radio").check();
  await press(page, "Move in a line", "The arm is at 'in frame'.");
  const turned = (await kept()).find((point) => point.name === "turned");
  for (const [index, joint] of (await joints()).entries()) expect(joint).toBeCloseTo(turned?.joints[index] ?? Number.NaN, 2);
  expect((await watch.instances()).filter((one) => one.verb.startsWith("move_"))).toEqual([]);
});

test("a motion is stopped by its button", async () => {
  const { page } = operator;
  // A person enters a point that is far away: the motion there takes a minute.
  const [home] = await kept();
  const far = (home?.joints ?? []).map((joint, index) => (index === 5 ? joint + 3 : joint));
  writeFileSync(file(), readFileSync(file(), "utf8").replace("[points]", `[points]\nfar = {joints = [${far.join(", ")}]}`));
  await panel(page).getByLabel("Speed").fill("5");
  await row(page, "far").getByRole("radio").check();
  await press(page, "Move joints", "The arm moves to 'far'.");
  await command(button(page, "Stop"), panel(page).getByRole("alert").getByText("The motion to 'far' was stopped before its end."));
  await panel(page).getByLabel("Speed").fill("50");
  await row(page, "home").getByRole("radio").check();
  await press(page, "Move joints", "The arm is at 'home'.");
});

test("a frame that is moved moves its points: they are gone to in a line, for their joints are others", async () => {
  const { page } = operator;
  const before = await row(page, "tray").locator("td.number").textContent();
  writeFileSync(file(), readFileSync(file(), "utf8").replace("[0.3, 0.1, 0.05]", "[0.3, 0.1, 0.07]"));
  await expect.poll(() => row(page, "tray").locator("td.number").textContent()).not.toBe(before);
  await row(page, "tray").getByRole("radio").check();
  await panel(page).getByText("Its frame or tool has changed since it was taught: move in a line.").waitFor();
  expect(await button(page, "Move joints").isDisabled()).toBe(true);
  await press(page, "Move in a line", "The arm is at 'tray'.");
  const figure = Number.parseFloat((await page.locator('[data-pose="Z"]').textContent()) ?? "");
  expect(figure).toBeCloseTo(Number.parseFloat(before?.split(", ")[2] ?? "") + 20, 0);
});

test("a point is renamed in its place, deleted, and put back", async () => {
  const { page } = operator;
  await row(page, "tray").getByRole("radio").check();
  await panel(page).getByLabel("Name").fill("feeder");
  await press(page, "Rename", "'tray' was renamed 'feeder'.");
  expect(await names()).toEqual(["far", "home", "feeder", "turned", "in frame"]);
  await press(page, "Delete", "'feeder' was deleted. Undo restores it.");
  expect(await names()).toEqual(["far", "home", "turned", "in frame"]);
  await press(page, "Undo", "'feeder' was restored.");
  expect(await names()).toEqual(["far", "home", "turned", "in frame", "feeder"]);
  await row(page, "feeder").getByText("above the tray").waitFor();
});

test("nothing moves because of a message or a point, at any width, and axe finds nothing", async () => {
  const { page, errors } = operator;
  await panel(page).getByLabel("Name").fill("more");
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    await button(page, "Delete").scrollIntoViewIfNeeded();
    await standsStill(button(page, "Delete"));
    const place = async () => JSON.stringify(await button(page, "Delete").boundingBox());
    const before = await place();
    await press(page, look === LOOKS[0] ? "Teach" : "Teach again", "'more' was taught at the present position.");
    expect(await place()).toBe(before);
    await shoot(page, `points-${look.width}-${look.scheme}`);
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth)).toBe(true);
    const edge = await panel(page).evaluate((of) => {
      const right = of.getBoundingClientRect().right;
      const inside = [...of.querySelectorAll("button, select, input:not([type=radio])")];
      return inside.filter((one) => one.getBoundingClientRect().right > right).map((one) => one.textContent);
    });
    expect(edge, `beyond the panel at ${look.width}`).toEqual([]);
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  expect(await stopRectangles(page)).toEqual([STOP]);
  expect(errors).toEqual([]);
});

test("joints that nobody reads are not taught, and a file that cannot be used says why", async () => {
  const { page } = operator;
  await command(page.getByRole("button", { name: "Disable all" }), page.locator(".tool.old"));
  await expect.poll(() => page.locator("table.family").getByText("disabled").count()).toBe(6);
  const before = await names();
  await command(button(page, "Teach again"), panel(page).getByRole("alert").getByText("6 joints of this arm are not enabled"));
  expect(await names()).toEqual(before);
  writeFileSync(file(), readFileSync(file(), "utf8").replace('frame = "table"', 'frame = "tabel"'));
  await panel(page)
    .getByRole("alert")
    .getByText(/uses the frame 'tabel'/)
    .waitFor();
});
