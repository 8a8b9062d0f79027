// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { RefusalError } from "./refusals";
import { forEach } from "./together";

test("no device waits for another one, and each refusal is told", async () => {
  const begun: string[] = [];
  const end: (() => void)[] = [];
  const call = (device: string) => {
    begun.push(device);
    if (device === "elbow") return Promise.reject(new RefusalError([{ class: "InvalidState", message: "elbow is in use" }], 409));
    if (device === "wrist") return Promise.reject(new Error("wrist is gone"));
    return new Promise<void>((over) => end.push(over));
  };
  const done = forEach(["shoulder", "elbow", "wrist", "hand"], call);
  expect(begun).toEqual(["shoulder", "elbow", "wrist", "hand"]);
  for (const over of end) over();
  const why = await done.then(
    () => null,
    (why: unknown) => why,
  );
  expect(why).toBeInstanceOf(RefusalError);
  expect((why as RefusalError).refusals.map((one) => one.message)).toEqual(["elbow is in use", "wrist is gone"]);
});
