// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { newGraph } from "./definition";
import { placesOf } from "./places";

test("boxes without a position stand in a row next to the others, over none of them", () => {
  const draft = newGraph("graph");
  draft.of.layout = { a: { x: 0, y: 40 }, b: { x: 480, y: 200 } };
  const places = placesOf([{ id: "a" }, { id: "c" }, { id: "b" }, { id: "d" }], draft);
  expect(places.get("a")).toEqual({ x: 0, y: 40 });
  expect(places.get("c")).toEqual({ x: 720, y: 40 });
  expect(places.get("d")).toEqual({ x: 960, y: 40 });
});
