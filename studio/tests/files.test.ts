// SPDX-License-Identifier: Apache-2.0
// 200 definitions written by `save` pass through the editor's open and save, and mean the same to `gpac.load`. Runs without a browser.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { afterAll, beforeAll, expect, test } from "vitest";
import { draftsOf, savedFile } from "../src/views/flow/edit/file";
import { PYTHON, SURROUNDINGS } from "./running";

let folder: string;

function python(what: "write" | "compare"): string {
  return execFileSync(PYTHON, [join(import.meta.dirname, "files.py"), what, folder], { env: SURROUNDINGS }).toString();
}

beforeAll(() => {
  folder = mkdtempSync(join(tmpdir(), "studio-files-"));
});

afterAll(() => rmSync(folder, { recursive: true, force: true }));

test("200 definitions are opened and saved, unchanged byte for byte, changed and changed back with the same meaning", () => {
  expect(python("write")).toContain("200 definitions");
  const files = readdirSync(folder);
  expect(files).toHaveLength(200);
  for (const name of files) {
    const text = readFileSync(join(folder, name), "utf8");
    const wanted = basename(name).replace(/\.\w+$/, "");
    const draft = draftsOf(text).find((one) => one.of.name === wanted);
    if (!draft) throw new Error(`${name} has no '${wanted}'`);
    expect(savedFile(draft, { name, text }).text, name).toBe(text);
    // Saved without knowledge of the opened file: everything is rewritten.
    writeFileSync(join(folder, `${name}.saved.json`), savedFile(draft, null).text);
  }
  expect(python("compare")).toContain("200 definitions");
});
