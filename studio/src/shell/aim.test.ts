// SPDX-License-Identifier: Apache-2.0
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, test } from "vitest";
import { isAside, type Spot } from "./aim";

const control = (name: string) => ({ name }) as unknown as Element;
const [home, reach, other] = [control("home"), control("reach"), control("other")];
const spot = (of: Element, name: string, top: number): Spot => ({ control: of, name, box: { left: 0, right: 100, top, bottom: top + 40 } });
const before = [spot(home, "BUTTON Home", 0), spot(reach, "BUTTON Reach", 40)];

test("a press hits what was there, or where nothing was", () => {
  expect(isAside(home, "BUTTON Home", 50, 20, before)).toBe(false);
  expect(isAside(other, "BUTTON Reset", 50, 100, before)).toBe(false);
});

test("a control that moved under the finger, or came over another, is not hit", () => {
  expect(isAside(reach, "BUTTON Reach", 50, 20, before)).toBe(true);
  expect(isAside(other, "BUTTON Hand over", 50, 60, before)).toBe(true);
});

test("a control that was drawn anew is the same one", () => {
  expect(isAside(other, "BUTTON Home", 50, 20, before)).toBe(false);
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
