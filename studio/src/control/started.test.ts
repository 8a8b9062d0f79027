// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import type { Statistics } from "./shapes";
import { StartedInstances } from "./started";

function storage(): Pick<Storage, "getItem" | "setItem"> {
  const kept = new Map<string, string>();
  return { getItem: (key) => kept.get(key) ?? null, setItem: (key, text) => void kept.set(key, text) };
}

const now = { instances: [{ id: 3, state: "running" }] } as unknown as Statistics;

test("a reloaded page knows what it has started in this run of the system, and deletes nothing that it has created before", () => {
  const kept = storage();
  const before = new StartedInstances("a", kept);
  before.make(3);
  before.add(3);
  const reloaded = new StartedInstances("a", kept);
  expect([reloaded.made(3), reloaded.running(now)]).toEqual([false, true]);
  expect(new StartedInstances("b", kept).running(now)).toBe(false);
});

test("instances of an earlier run are forgotten, and damaged storage counts as empty", () => {
  const kept = storage();
  const page = new StartedInstances("a", kept);
  page.add(3);
  page.forget("b");
  expect(page.running(now)).toBe(false);
  expect(new StartedInstances("a", kept).running(now)).toBe(false);
  page.add(3);
  expect(new StartedInstances("b", kept).running(now)).toBe(true);
  kept.setItem("opengpac.started", "{");
  expect(new StartedInstances("b", kept).running(now)).toBe(false);
});
