// SPDX-License-Identifier: Apache-2.0
import { normalizeWorkspaceModel } from "react-resizable-panels";
import { expect, test } from "vitest";
import type { Region } from "../../control/shapes";
import { freshId, headingOf, layoutOf, modelOf, panelsOf, sharesOf, tabsetsOf } from "./layout";

const LAYOUT: Region = {
  row: [
    {
      share: 1.5,
      column: [
        { panel: "plot", title: "Joint", names: ["a", "b"], seconds: 5 },
        { panel: "scene", device: "arm" },
      ],
    },
    { share: 0.5, tabs: [{ panel: "alarms" }, { panel: "verb", verb: "fill" }] },
  ],
};

const modelled = (layout: Region) => {
  const model = normalizeWorkspaceModel<Region>(modelOf(layout));
  if (!model) throw new Error("the library does not take the model");
  return model;
};

test("a layout comes back from the docking library as it went in", () => {
  expect(layoutOf(modelled(LAYOUT))).toEqual(LAYOUT);
  expect(layoutOf(modelled({ panel: "alarms" }))).toEqual({ panel: "alarms" });
});

test("shares are of the neighbours, whatever their sum, and equal ones are not written", () => {
  const two = (a: number, b: number): Region => ({
    column: [
      { share: a, panel: "alarms" },
      { share: b, panel: "verb", verb: "v" },
    ],
  });
  expect(layoutOf(modelled(two(3, 1)))).toEqual(two(1.5, 0.5));
  expect(layoutOf(modelled(two(7, 7)))).toEqual({ column: [{ panel: "alarms" }, { panel: "verb", verb: "v" }] });
  expect(sharesOf([50, null, null])).toEqual([1.5, 0.75, 0.75]);
});

test("where panels are gone their rows and columns go too", () => {
  const model = modelled(LAYOUT);
  for (const tabset of tabsetsOf(model.root)) {
    if (tabset.tabs.some((tab) => tab.data.panel !== "plot")) tabset.tabs = [];
  }
  expect(layoutOf(model)).toEqual({ panel: "plot", title: "Joint", names: ["a", "b"], seconds: 5 });
  for (const tabset of tabsetsOf(model.root)) tabset.tabs = [];
  expect(layoutOf(model)).toBeNull();
});

test("panels stand in their order, each with a heading and an identity of its own", () => {
  expect(panelsOf(LAYOUT).map(headingOf)).toEqual(["Joint", "Machine arm", "Alarms", "Verb fill"]);
  const model = modelled(LAYOUT);
  const ids = tabsetsOf(model.root).flatMap((tabset) => tabset.tabs.map((tab) => tab.id));
  expect(new Set(ids).size).toBe(4);
  expect(ids).not.toContain(freshId(model));
});
