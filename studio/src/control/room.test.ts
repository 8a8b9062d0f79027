// SPDX-License-Identifier: Apache-2.0
import { afterEach, expect, test, vi } from "vitest";
import { request } from "./requests";

/** Pending answers of the system, in request order. */
const open: { path: string; answer: () => void }[] = [];

vi.stubGlobal(
  "fetch",
  (path: string) => new Promise((resolve) => open.push({ path, answer: () => resolve(new Response('{"result": 1}')) })),
);

afterEach(async () => {
  while (open.length > 0) {
    open.shift()?.answer();
    await new Promise((wait) => setTimeout(wait));
  }
});

const ask = (path: string, more = {}, signal?: AbortSignal) =>
  request({ token: null, session: null, ...more }, "GET", path, undefined, signal);
const paths = () => open.map((one) => one.path);
const settle = () => new Promise((wait) => setTimeout(wait));

test("what stops or moves something is asked at once, however many answers are waited for", async () => {
  const all = ["a", "b", "c", "d", "e"].map((path) => ask(path));
  const stop = ask("stop", { isUrgent: true });
  const jog = ask("jog", { isFirst: true });
  await settle();
  expect(paths()).toEqual(["stop", "jog", "a", "b", "c"]);
  open.push(...open.splice(0, 2));
  open.splice(0, 1)[0]?.answer();
  await settle();
  expect(paths()).toEqual(["b", "c", "stop", "jog", "d"]);
  for (const one of open.splice(0)) one.answer();
  await settle();
  expect(paths()).toEqual(["e"]);
  open.splice(0, 1)[0]?.answer();
  expect(await Promise.all([...all, stop, jog])).toEqual([1, 1, 1, 1, 1, 1, 1]);
});

test("who gives up while it waits leaves its place, and is never asked for", async () => {
  for (const path of ["a", "b", "c"]) void ask(path);
  const control = new AbortController();
  const given = ask("given up", {}, control.signal);
  const next = ask("next");
  control.abort();
  await expect(given).rejects.toThrow(/abort/i);
  open.splice(0, 1)[0]?.answer();
  await settle();
  expect(paths()).toEqual(["b", "c", "next"]);
  void next;
});
