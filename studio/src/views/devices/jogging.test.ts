// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { RefusalError } from "../../control/refusals";
import type { Source } from "../../control/source";
import { JOG_TOOL, type JogMotion, Press } from "./jogging";

/** A system whose calls are listed, with the time of the press that each was made for. */
class Rig {
  now = 1000;
  readonly calls: [string, number | undefined][] = [];
  refusesStart = false;
  readonly source = {
    pressed: () => this.now,
    order: async (name: string, _args: object, _signal?: AbortSignal, pressed?: number) => {
      this.calls.push([name, pressed]);
      if (name === "start" && this.refusesStart)
        throw new RefusalError([{ class: "InvalidState", message: "'start' came 900 ms after it was given" }], 409);
      return 7;
    },
    look: async (name: string) => (name === "state" ? "ended" : { condition: "arrived" }),
    stop: async () => undefined,
  } as unknown as Source;

  times(of: string): (number | undefined)[] {
    return this.calls.filter(([name]) => name === of).map(([, pressed]) => pressed);
  }
}

const MOTION: JogMotion = { verb: JOG_TOOL, devices: ["a"], values: {}, isStep: true };

test("a step that waits for the press before it is as old as its own press", async () => {
  const rig = new Rig();
  let over: () => void = () => undefined;
  const press = new Press(rig.source, MOTION, new Promise<void>((done) => (over = done)));
  press.release();
  rig.now = 1900;
  over();
  expect(await press.done).toEqual({ condition: "arrived" });
  expect(rig.times("start")).toEqual([1000]);
});

test("a button that is held commands at the time of each call, and one that is let go before commands nothing", async () => {
  const rig = new Rig();
  await new Press(rig.source, { ...MOTION, isStep: false }).done;
  expect(rig.times("start")).toEqual([undefined]);
  const released = new Press(rig.source, { ...MOTION, isStep: false }, Promise.resolve());
  released.release();
  expect(await released.done).toBe(null);
  expect(rig.times("start").length).toBe(1);
});

test("an instance whose step came late is started by the next press, and not made again", async () => {
  const rig = new Rig();
  rig.refusesStart = true;
  let over: () => void = () => undefined;
  const late = new Press(rig.source, MOTION, new Promise<void>((done) => (over = done)));
  rig.now = 1900;
  over();
  await expect(late.done).rejects.toThrow("after it was given");
  expect(rig.times("delete")).toEqual([]);
  rig.refusesStart = false;
  await new Press(rig.source, MOTION).done;
  expect(rig.times("create").length).toBe(1);
  expect(rig.times("delete").length).toBe(1);
});
