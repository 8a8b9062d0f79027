// SPDX-License-Identifier: Apache-2.0
// Verbs of the docs are drawn in the editor from scratch, with forms and without any JSON, and equal those of Python.
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { activate, add, apart, begin, block, choose, enter, nameCell, panelOf, parameter, rename, wire } from "./drawing";
import { axeFindings, browse, goTo, LOOKS, type Opened, open, PYTHON, type Running, run, SURROUNDINGS, shoot } from "./running";

let running: Running;
let browser: Browser;
let opened: Opened;
let folder: string;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), "studio-drawn-"));
  [running, browser] = await Promise.all([run(join(import.meta.dirname, "drawn_cell.py"), "--edit"), browse(false)]);
  opened = await open(browser, running.url, { width: 1440, height: 1400, scheme: "light" });
});

afterAll(async () => {
  await browser?.close();
  await running?.stop();
  rmSync(folder, { recursive: true, force: true });
});

async function save(page: Page, name: string): Promise<void> {
  await expect.poll(() => panelOf(page, "Checks").textContent()).toContain("all passed");
  const saved = page.waitForEvent("download");
  await page.getByRole("button", { name: "Save file" }).click();
  copyFileSync(await (await saved).path(), join(folder, `${name}.json`));
}

test("swing, the first verb of the README", async () => {
  const { page } = opened;
  await expect.poll(() => running.said()).toContain("the modules are there");
  await goTo(page, "Data flow");
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await begin(page, "swing");
  await block(page, "library.signal_generator", "wave", { shape: "1" });
  await block(page, "library.time_limit", "clock");
  await add(page, "Objects", "Object", "joint", "joint", { type: "robot_joint" });
  await parameter(page, "joint.commanded");
  await wire(page, "wave", "Wire wave.y to", "joint.commanded");
  const inputs = { amplitude: "wave.amplitude", frequency: "wave.frequency", seconds: "clock.limit" };
  for (const [name, port] of Object.entries(inputs))
    await add(page, "Input parameters", "Input parameter", "goal", name, { "stored in": port });
  await add(page, "Output values", "Output value", "result", "commanded", { "read from": "wave.y" });
  await add(page, "Conditions", "Condition", "done", "over", { is: "clock.expired", returns: "commanded" });
  await page.getByRole("button", { name: "Command lists" }).click();
  await activate(page, "start", ["wave", "clock"], "20 ms");
  await page.getByRole("button", { name: "Data flow", exact: true }).click();
  await save(page, "swing");
});

test("guarded_move, with two writers of a cell, modes, and a transition", async () => {
  const { page, errors } = opened;
  await begin(page, "guarded_move");
  await enter(page, "purpose", "Moves the tool along a line until it meets a force, and slows to a stop.");
  await block(page, "library.read_vector", "sensor");
  await block(page, "library.force_guard", "guard");
  await block(page, "glide.glide", "glide");
  await block(page, "glide.brake", "brake");
  await block(page, "tool_line.tool_line", "line");
  await page.getByRole("button", { name: "Arrange" }).click();
  await wire(page, "glide", "Wire glide.along to", "brake.was_along");
  await wire(page, "glide", "Wire glide.along to", "line.along");
  await wire(page, "brake", "Wire brake.along to", "the cell along");
  await wire(page, "sensor", "Wire sensor.y to", "guard.force");
  await nameCell(page, "y", "sensed_force");
  await wire(page, "glide", "Wire glide.rate to", "brake.was_rate");
  await parameter(page, "arm.commanded");
  await wire(page, "line", "Wire line.start from", "arm.commanded");
  await wire(page, "line", "Wire line.setpoint to", "arm.commanded");
  await page.getByLabel("Mode of line.along").selectOption("asynchronous");
  await parameter(page, "force");
  await wire(page, "sensor", "Wire sensor.channel from", "force");
  await parameter(page, "magnitude");
  await wire(page, "guard", "Wire guard.magnitude to", "magnitude");
  await add(page, "Objects", "Object", "joint", "arm", { type: "robot_joint" });
  await panelOf(page, "Objects").getByLabel("several of them").check();
  const inputs = {
    distance: ["glide.distance", ""],
    direction: ["line.direction", "0.0, 0.0, 1.0"],
    speed: ["glide.speed", "0.03"],
    force_max: ["guard.above", "5.0"],
    deceleration: ["brake.deceleration", "0.5"],
  };
  for (const [name, [port = "", value = ""]] of Object.entries(inputs)) {
    const fields: Record<string, string> = value === "" ? { "stored in": port } : { "stored in": port, default: value };
    await add(page, "Input parameters", "Input parameter", "goal", name, fields);
  }
  const outputs = { met: "brake.began", stopped_at: "brake.along", force_met: "guard.above" };
  for (const [name, port] of Object.entries(outputs))
    await add(page, "Output values", "Output value", "result", name, { "read from": port });
  await page.getByRole("button", { name: "Command lists" }).click();
  await rename(page, "start", "go");
  await activate(page, "go", ["sensor", "guard", "glide", "line"], "1 ms");
  await panelOf(page, "Command lists").getByRole("button", { name: "Add", exact: true }).click();
  await rename(page, "list", "stop");
  await activate(page, "stop", ["sensor", "guard", "brake", "line"], "1 ms");
  await add(page, "Conditions", "Condition", "done", "contact", { is: "guard.above", during: "go", priority: "1" });
  await add(page, "Conditions", "Condition", "done", "stopped", {
    is: "brake.stopped",
    returns: "met, stopped_at, force_met",
    during: "stop",
  });
  await add(page, "Conditions", "Condition", "done", "arrived", { is: "glide.there", returns: "nothing", during: "go" });
  await panelOf(page, "Execution").getByLabel("begins with").selectOption("go");
  await panelOf(page, "Transitions").getByRole("button", { name: "Add", exact: true }).click();
  const line = panelOf(page, "Transitions").getByRole("group");
  await line.getByLabel("Condition").selectOption("contact");
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    await shoot(page, `drawn-${look.width}-${look.scheme}`);
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
  }
  await save(page, "guarded_move");
  expect(errors).toEqual([]);
});

test("press, made of a verb of a file and one of the system, as superstates", async () => {
  const { page, errors } = opened;
  execFileSync(PYTHON, [join(import.meta.dirname, "drawn.py"), folder, "approach"], { env: SURROUNDINGS });
  await page.locator('input[type="file"]').setInputFiles(join(folder, "approach.json"));
  await page.getByRole("button", { name: "New composition" }).click();
  await enter(page, "Composition", "press");
  await enter(page, "purpose", "Moves fast to the part, then presses slowly to the depth.");
  await page.locator('[data-verb="approach"]').click();
  await page.locator('[data-part="approach"]').waitFor();
  await page.getByLabel("Add a verb of the system").focus();
  await page.getByLabel("Add a verb of the system").selectOption("insert");
  // Drawn from part to part with the mouse; the arrow gets the condition that ends the first one.
  const port = (part: string, side: string) => page.locator(`[data-part="${part}"] > .react-flow__handle.${side}:not(.back)`);
  await page.locator('[data-list="insert.start"]').waitFor();
  await port("approach", "source").dragTo(port("insert", "target"));
  await page.locator(".route-label").getByText("there").first().waitFor();
  for (const [part, name] of [
    ["approach", "contact"],
    ["insert", "depth"],
  ] as const) {
    await page.locator(`[data-part="${part}"] strong`).click();
    await enter(panelOf(page, `Part ${part}`), "input to", name);
  }
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    await shoot(page, `composed-${look.width}-${look.scheme}`);
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
  }
  await save(page, "press");
  expect(errors).toEqual([]);
});

test("a verb that requires, comes to rest before it is suspended, has a budget and an interval that may change", async () => {
  const { page, errors } = opened;
  await page.setViewportSize({ width: 1440, height: 1400 });
  await begin(page, "careful");
  await block(page, "library.motion_generator", "generator");
  await add(page, "Objects", "Object", "joint", "arm", { type: "robot_joint" });
  await panelOf(page, "Objects").getByLabel("several of them").check();
  await parameter(page, "arm.commanded");
  await wire(page, "generator", "Wire generator.start from", "arm.commanded");
  await wire(page, "generator", "Wire generator.setpoint to", "arm.commanded");
  await parameter(page, "arm.commanded_velocity");
  await wire(page, "generator", "Wire generator.start_velocity from", "arm.commanded_velocity");
  const inputs: Record<string, Record<string, string>> = {
    goal: { within: "arm.position_min, arm.position_max", "counted from": "arm.commanded" },
    speed: { default: "25 %", within: "0.001, arm.max_speed" },
    override: { default: "1.0", within: "0, 1" },
  };
  for (const [name, fields] of Object.entries(inputs))
    await add(page, "Input parameters", "Input parameter", name === "goal" ? "goal" : "goal2", name, {
      "stored in": `generator.${name}`,
      ...fields,
    });
  const override = panelOf(page, "Input parameters").getByRole("group", { name: "Input parameter override" });
  await override.getByLabel("may be set while it runs").check();
  await add(page, "Requirements", "Requirement", "arm.homed", "arm.homed", { "only when": "arm.needs_home", remedy: "home it first" });
  const whole = panelOf(page, "Execution");
  await whole.getByLabel("when it is suspended").selectOption({ label: "its blocks come to rest first" });
  const rest = whole.getByRole("group", { name: "Coming to rest 1" });
  await enter(rest, "sets", "generator.holding");
  await enter(rest, "until", "generator.held");
  await add(page, "Conditions", "Condition", "done", "there", { is: "generator.finished", returns: "nothing" });
  await page.getByRole("button", { name: "Command lists" }).click();
  await activate(page, "start", ["generator"], "20 ms");
  const command = panelOf(page, "Command list start").getByRole("group", { name: "Command 1", exact: true });
  await enter(command, "budget", "5 km");
  await command.getByRole("alert").waitFor();
  await enter(command, "budget", "5 ms");
  await command.getByLabel("interval may change").check();
  for (const look of LOOKS) {
    await page.setViewportSize({ width: look.width, height: look.height });
    await page.emulateMedia({ colorScheme: look.scheme });
    expect(await axeFindings(page), `${look.width} ${look.scheme}`).toEqual([]);
    expect(await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)).toBe(0);
  }
  await save(page, "careful");
  expect(errors).toEqual([]);
});

test("a graph in which a block runs once in five invocations", async () => {
  const { page, errors } = opened;
  await page.setViewportSize({ width: 1440, height: 1400 });
  await page.getByRole("button", { name: "New graph" }).click();
  await enter(page, "Graph", "thinned");
  await block(page, "library.signal_generator", "wave");
  await block(page, "library.lowpass", "slow");
  await wire(page, "wave", "Wire wave.y to", "slow.u");
  await nameCell(page, "y", "raw");
  // Boxes added while the layout is computed stay in place.
  const before = await apart(page, "wave", "slow");
  await page.evaluate(() => {
    const buttons = [...document.querySelectorAll("button")];
    for (const name of ["Arrange", "Add output"]) buttons.find((one) => one.textContent === name)?.click();
  });
  await expect.poll(() => apart(page, "wave", "slow")).not.toBe(before);
  await wire(page, "slow", "Wire slow.y to", "output");
  await choose(page, "output");
  await enter(panelOf(page, "output"), "Name", "y");
  await choose(page, "slow");
  await enter(panelOf(page, "slow"), "once in", "0");
  await panelOf(page, "slow").getByText("'0' is not a number of invocations").waitFor();
  await enter(panelOf(page, "slow"), "once in", "5");
  await page.getByLabel("Mode of slow.u").selectOption("ratio");
  await enter(panelOf(page, "slow"), "values per invocation", "5");
  await save(page, "thinned");
  expect(errors).toEqual([]);
});

test("what was drawn is equal to what Python has", () => {
  const said = execFileSync(PYTHON, [join(import.meta.dirname, "drawn.py"), folder], { env: SURROUNDINGS }).toString();
  expect(said).toContain("swing is equal");
  expect(said).toContain("guarded_move is equal");
  expect(said).toContain("careful is equal");
  expect(said).toContain("thinned is equal");
  expect(said).toContain("press is equal");
});
