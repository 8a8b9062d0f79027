// SPDX-License-Identifier: Apache-2.0
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, test } from "vitest";
import { worded } from "./wording";

const CRATES = join(import.meta.dirname, "../../../crates");

/** Returns the texts of a crate's refusals that contain a Python option, `name=`. */
function optionsIn(crate: string): string[] {
  const files = readdirSync(join(CRATES, crate, "src"), { recursive: true, encoding: "utf8" }).filter((file) => file.endsWith(".rs"));
  return files.flatMap((file) => {
    const lines = readFileSync(join(CRATES, crate, "src", file), "utf8").split("\n");
    const code = lines.filter((line) => !/^\s*(\/\/|#\[)/.test(line)).join("\n");
    return [...code.matchAll(/"((?:[^"\\\n]|\\.)*)"/g)]
      .map(([, text = ""]) => text.replaceAll('\\"', '"'))
      .filter((text) => OPTION.test(text));
  });
}

const OPTION = /(^|[\s({.])[a-z_]+=(?!=)/;

test("no message of the core reaches the page with an option of Python in it", () => {
  const texts = ["model", "supervisor", "replay"].flatMap(optionsIn);
  expect(texts.length).toBeGreaterThan(30);
  expect(texts.map((text) => worded(text)).filter((text) => OPTION.test(text) || /tunable=True|gpac\./.test(text))).toEqual([]);
});

test("remedies are sentences of the page", () => {
  const said = (text: string) => worded(text);
  expect(said("relax it with modes={'sum.b': 'asynchronous'}")).toBe("set the mode of 'sum.b' to asynchronous");
  expect(said("set initial= to one of start, back")).toBe("choose the command list that it begins with, one of start, back");
  expect(said("if you trust its origin, replay it with trust=True (opengpac replay --trust)")).toBe(
    "if you trust its origin, replay it as trusted",
  );
  expect(said("write activate('sum', every='1 ms'), or place it on a trigger")).toBe(
    "give the command activate of 'sum' an interval, for example 1 ms, or place it on a trigger",
  );
  expect(said("raise kp= and kd=, or raise max_following_error=")).toBe("raise 'kp' and 'kd', or raise 'max_following_error'");
  expect(said("units differ: x = 3, y == 4")).toBe("units differ: x = 3, y == 4");
});
