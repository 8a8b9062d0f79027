// SPDX-License-Identifier: Apache-2.0
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, test } from "vitest";
import { isAside, type Spot } from "./aim";

const spot = (name: string, top: number): Spot => ({ name, box: { left: 0, right: 100, top, bottom: top + 40 } });
const before = [spot("BUTTON Home", 0), spot("BUTTON Reach", 40)];

test("a press hits what was there, or where nothing was", () => {
  expect(isAside("BUTTON Home", 50, 20, before)).toBe(false);
  expect(isAside("BUTTON Reset", 50, 100, before)).toBe(false);
});

test("a control that moved under the finger, or came over another, is not hit", () => {
  expect(isAside("BUTTON Reach", 50, 20, before)).toBe(true);
  expect(isAside("BUTTON Hand over", 50, 60, before)).toBe(true);
});

test("an element that was given another name is another control, as the button of the foremost alarm", () => {
  const alarm = [spot("BUTTON Acknowledge E7 of press 1", 0)];
  expect(isAside("BUTTON Acknowledge E7 of press 2", 50, 20, alarm)).toBe(true);
  expect(isAside("BUTTON Acknowledge E7 of press 1", 50, 20, alarm)).toBe(false);
});

/** Folders in which a press gives a command but does not move any machine: it registers a definition, or starts or ends a recording. */
const MOVES_NOTHING = ["views/flow/edit/", "views/recordings/"];

test("each control that commands is guarded", () => {
  const source = join(import.meta.dirname, "..");
  const commanding = readdirSync(source, { recursive: true, encoding: "utf8" })
    .filter((name) => name.endsWith(".tsx") && !MOVES_NOTHING.some((room) => name.startsWith(room)))
    .map((name) => ({ name, text: readFileSync(join(source, name), "utf8") }))
    .filter(({ text }) => /\b(control|live|from)\.(order|stop|command\.\w+)\(/.test(text) && text.includes("<button"));
  expect(commanding.length).toBeGreaterThan(10);
  expect(commanding.filter(({ text }) => !text.includes("data-commands")).map(({ name }) => name)).toEqual([]);
});
