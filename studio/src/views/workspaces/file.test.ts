// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Workspace } from "../../control/shapes";
import { fileName, fileText, fromFile } from "./file";

test("a workspace is written into a file and read again, and what is none says why", () => {
  const workspace: Workspace = { name: "tank 1/2", layout: { panel: "alarms" } };
  expect(fromFile(fileText(workspace))).toEqual(workspace);
  expect(fileName(workspace)).toBe("tank-1-2.workspace.json");
  expect(() => fromFile("{")).toThrow("the file is not a workspace");
  expect(() => fromFile("[]")).toThrow("it has no 'layout'");
  expect(() => fromFile('{"workspace": 2, "layout": {}}')).toThrow("version 2 of the format of workspaces");
});
