// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { views } from "../shell/views";
import { blocksOf, sectionOf, spansOf } from "./markdown";
import { helpOf } from "./topics";

test("pages of the docs are read as blocks and spans", () => {
  const page = blocksOf(
    "# T\n\n<!-- prose -->\nOne\ntwo.\n\n| a | b |\n|---|---|\n| `x\\|y` | *z* |\n\n- p\n  q\n- r\n\n```sh\nls\n```\n![i](i.png)\n## U\nV\n",
  );
  expect(page).toEqual([
    { kind: "heading", level: 1, text: "T" },
    { kind: "text", text: "One two." },
    { kind: "table", head: ["a", "b"], rows: [["`x|y`", "*z*"]] },
    { kind: "list", items: ["p q", "r"] },
    { kind: "code", text: "ls" },
    { kind: "heading", level: 2, text: "U" },
    { kind: "text", text: "V" },
  ]);
  expect(sectionOf(page, "U")).toEqual([{ kind: "text", text: "V" }]);
  expect(sectionOf(page, "nothing")).toEqual([]);
  expect(spansOf("a `b*` **c** *d* [e](f.md#g) 2 * 3")).toEqual([
    { kind: "plain", text: "a " },
    { kind: "code", text: "b*" },
    { kind: "plain", text: " " },
    { kind: "strong", text: "c" },
    { kind: "plain", text: " " },
    { kind: "emphasis", text: "d" },
    { kind: "plain", text: " e 2 * 3" },
  ]);
});

test("a line of a paragraph may begin with code", () => {
  expect(blocksOf("The command\n`opengpac studio` opens\nthe page.\n```sh\nls\n```\n")).toEqual([
    { kind: "text", text: "The command `opengpac studio` opens the page." },
    { kind: "code", text: "ls" },
  ]);
});

test.each(views.filter((view) => !view.alone))("the docs say something of the view $title", ({ name }) => {
  expect(helpOf(name).length).toBeGreaterThan(name === "system" ? 1 : 2);
});
