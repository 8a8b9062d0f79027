// SPDX-License-Identifier: Apache-2.0
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { AGAIN_MS } from "../../control/asking";
import { type Refusal, RefusalError } from "../../control/refusals";
import { WatchedValue } from "../../control/watched";
import { drawBeside, type Scene } from "./beside";

vi.mock("../../design/colours", () => ({ colour: () => "rgb(0, 0, 0)" }));
beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

/** Returns a machine of one body in a recording that has no values for a ghost; `span` is asked for those of the path. */
function recorded(span: () => Promise<void>): { scene: Scene; cursor: WatchedValue<number> } {
  const cursor = new WatchedValue(0);
  const channel = (name: string) => (name === "arm.a.sensed" ? { name, type_text: "double", unit: "rad", components: 1 } : undefined);
  const past = {
    begins_ns: 0,
    ends_ns: 10e9,
    cursor,
    channel,
    async *span() {
      await span();
      yield { channels: [{ samples: "", sums: [] }], next: null };
    },
  };
  const joint = { name: "a", kind: "hinge", axis: [0, 0, 1], position: [0, 0, 0], reference: 0, svv: "arm.a.sensed" };
  const body = { name: "one", parent: null, position: [0, 0, 0], quaternion: [1, 0, 0, 0], joint: null, joints: [joint], geoms: [] };
  const scene = {
    control: { past, topics: { installed: { get: () => null } } },
    geometry: { meshes: [], contacts: null, bodies: [body] },
    stage: { add: () => undefined, remove: () => undefined, draw: () => undefined },
    told: {},
  };
  return { scene: scene as unknown as Scene, cursor };
}

const DRAWN = { frames: false, force_N: null, path_s: 1, body: "one", ghost: "commanded" as const };
const refused = (status: number) => new RefusalError([{ class: "InvalidState", message: `status ${status}` }], status);

test("a path that is drawn at last does not hide why there is no ghost", async () => {
  const told: Refusal[][] = [];
  const { scene } = recorded(vi.fn<() => Promise<void>>().mockRejectedValueOnce(refused(503)).mockResolvedValue(undefined));
  const end = drawBeside(scene, DRAWN, (refusals) => told.push(refusals));
  await vi.advanceTimersByTimeAsync(0);
  const ghost = expect.stringContaining("commanded");
  expect(told.at(-1)?.map((one) => one.message)).toEqual(["status 503", ghost]);
  await vi.advanceTimersByTimeAsync(AGAIN_MS);
  expect(told.at(-1)?.map((one) => one.message)).toEqual([ghost]);
  expect(scene.told.path).toBeDefined();
  end();
});

test("the path of another position of the cursor is asked for at the intervals of a new question", async () => {
  const begins_ms = Date.now();
  const asked: number[] = [];
  const { scene, cursor } = recorded(() => {
    asked.push(Date.now() - begins_ms);
    return Promise.reject(refused(500));
  });
  const end = drawBeside(scene, { ...DRAWN, ghost: null }, () => undefined);
  await vi.advanceTimersByTimeAsync(3 * AGAIN_MS);
  expect(asked).toEqual([0, AGAIN_MS, 3 * AGAIN_MS]);
  cursor.set(5e9);
  await vi.advanceTimersByTimeAsync(AGAIN_MS);
  expect(asked.slice(3)).toEqual([3 * AGAIN_MS, 4 * AGAIN_MS]);
  end();
  expect(vi.getTimerCount()).toBe(0);
});
