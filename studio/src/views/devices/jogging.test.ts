// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { RefusalError } from "../../control/refusals";
import type { Source } from "../../control/source";
import { BEAT, JOG_TOOL, type JogMotion, Press } from "./jogging";

/** A mock system that records the calls made to it, each with the time of the press that caused it. */
class Rig {
  now: number | null = 1000;
  readonly calls: [string, number | undefined][] = [];
  /** Values written as heartbeats, and the inputs of each start. */
  readonly beats: number[] = [];
  readonly starts: { client?: number }[] = [];
  inputs = ["velocity", "client"];
  /** States that an instance passes through before it ends. */
  states: string[] = [];
  refusesStart = false;
  readonly source = {
    pressed: () => this.now,
    order: async (name: string, args: { name?: string; value?: number; values?: object }, _signal?: AbortSignal, pressed?: number) => {
      this.calls.push([name, pressed]);
      if (name === "write" && args.name === BEAT) this.beats.push(args.value ?? 0);
      if (name === "start") this.starts.push(args.values ?? {});
      if (name === "start" && this.refusesStart)
        throw new RefusalError([{ class: "InvalidState", message: "'start' arrived 900 ms after it was issued" }], 409);
      return 7;
    },
    look: async (name: string) => {
      if (name === "verb_form") return { inputs: this.inputs.map((input) => ({ name: input })) };
      return name === "state" ? (this.states.shift() ?? "ended") : { condition: "arrived" };
    },
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

test("an instance is deleted when the connection is there again, not left behind", async () => {
  const rig = new Rig();
  const press = new Press(rig.source, { ...MOTION, isStep: false });
  press.leave();
  rig.states = ["running"];
  // Halts are sent without a connection that is known to work; a deletion is not.
  rig.source.stop = async () => {
    rig.now = null;
    setTimeout(() => {
      rig.now = 2000;
    }, 0);
  };
  const held = new Press(rig.source, { ...MOTION, isStep: false }, press.done);
  while (rig.starts.length === 0) await new Promise((soon) => setTimeout(soon, 0));
  held.release();
  await held.done;
  expect(rig.now).toBe(2000);
  expect(rig.times("delete").length).toBe(1);
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
  await expect(late.done).rejects.toThrow("after it was issued");
  expect(rig.times("delete")).toEqual([]);
  rig.refusesStart = false;
  await new Press(rig.source, MOTION).done;
  expect(rig.times("create").length).toBe(1);
  expect(rig.times("delete").length).toBe(1);
});

test("each press beats as a client of its own, which its motion alone counts", async () => {
  const rig = new Rig();
  for (const _press of [1, 2]) {
    rig.states = ["running", "running"];
    await new Press(rig.source, { ...MOTION, isStep: false }).done;
  }
  const clients = rig.starts.map((start) => start.client ?? 0);
  expect(new Set(clients).size).toBe(2);
  expect(clients.every((client) => client >= 1 && client < 2 ** 31)).toBe(true);
  expect(rig.beats.map((beat) => Math.floor(beat / 2 ** 20))).toEqual(clients.flatMap((client) => [client, client, client, client]));
  expect(new Set(rig.beats).size).toBe(rig.beats.length);
});

test("a verb of a program that knows no clients is started without one", async () => {
  const rig = new Rig();
  rig.inputs = ["velocity"];
  await new Press(rig.source, MOTION).done;
  expect(rig.starts).toEqual([{}]);
});
