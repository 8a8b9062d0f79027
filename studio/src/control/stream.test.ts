// SPDX-License-Identifier: Apache-2.0
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { LiveValues } from "../live/values";
import { RefusalError } from "./refusals";
import { Stream } from "./stream";
import { Topics } from "./topics";

/** A mock socket, controlled by the test. */
class Socket {
  static OPEN = 1;
  static made: Socket[] = [];
  readyState = 0;
  binaryType = "";
  onopen: (() => void) | null = null;
  onmessage: ((message: { data: unknown }) => void) | null = null;
  onclose: ((end?: { code: number }) => void) | null = null;
  readonly sent: Record<string, unknown>[] = [];

  constructor(
    readonly url: string,
    readonly protocols: string[],
  ) {
    Socket.made.push(this);
  }

  send(text: string) {
    this.sent.push(JSON.parse(text));
  }
  close() {
    this.onclose?.();
  }
  opens() {
    this.readyState = 1;
    this.onopen?.();
    this.says({ beat: Date.now() });
  }
  says(frame: object) {
    this.onmessage?.({ data: JSON.stringify(frame) });
  }
}

const made = () => Socket.made.at(-1) as Socket;
let stream: Stream;

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("WebSocket", Socket);
  vi.stubGlobal("requestAnimationFrame", (draw: () => void) => setTimeout(draw, 0));
  Socket.made = [];
  stream = new Stream(() => ({ url: "ws://here/v1/stream", token: "secret" }));
  stream.open();
});

afterEach(() => {
  stream.close();
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("the token goes as a subprotocol, never in the address", () => {
  expect(made().protocols).toEqual(["opengpac.v1", "bearer.secret"]);
  expect(made().url).not.toContain("secret");
});

test("a connection that breaks is made again, and the log goes on where it was", () => {
  const topics = new Topics(stream);
  const end = topics.log.watch(() => undefined);
  made().opens();
  expect(made().sent).toEqual([{ subscribe: "log", since: 0, id: "log-1" }]);
  made().says({ id: "log-1", log: [{ sequence: 6, time_s: 1, kind: "start", about: "a", text: "" }], dropped: 2 });
  expect(topics.log.get()).toMatchObject({ entries: [{ sequence: 6 }], dropped: 2 });
  made().onclose?.();
  expect(stream.connection.get()).toBe("broken");
  vi.advanceTimersByTime(300);
  expect(Socket.made).toHaveLength(2);
  made().opens();
  expect(made().sent).toEqual([{ subscribe: "log", since: 7, id: "log-1" }]);
  end();
  expect(made().sent.at(-1)).toEqual({ unsubscribe: "log-1" });
});

test("a connection is open once a beat has told the daemon's time: a command has to say when it was given", () => {
  const opened = () => {
    made().readyState = 1;
    made().onopen?.();
  };
  opened();
  expect([stream.connection.get(), stream.daemon_ms(performance.now())]).toEqual(["connecting", null]);
  made().says({ beat: 5000 });
  expect([stream.connection.get(), stream.daemon_ms(performance.now())]).toEqual(["open", 5000]);
  // The next connection may lead to another run, with a different clock.
  made().onclose?.();
  vi.advanceTimersByTime(300);
  opened();
  expect([stream.connection.get(), stream.daemon_ms(performance.now())]).toEqual(["broken", null]);
  made().says({ beat: 9000 });
  expect([stream.connection.get(), stream.daemon_ms(performance.now())]).toEqual(["open", 9000]);
});

test("whose token was revoked is told so, and does not come again", () => {
  made().opens();
  made().onclose?.({ code: 4401 });
  expect(stream.connection.get()).toBe("out");
  vi.advanceTimersByTime(60_000);
  expect(Socket.made).toHaveLength(1);
});

test("a page whose token a restarted daemon does not know says so, and does not come again", async () => {
  stream.close();
  let status = 0;
  stream = new Stream(
    () => ({ url: "ws://here/v1/stream", token: "old" }),
    () => Promise.reject(new RefusalError([{ class: "Unauthorized", message: "no" }], status)),
  );
  stream.open();
  // The system is unreachable: the connection is retried.
  made().onclose?.({ code: 1006 });
  await vi.advanceTimersByTimeAsync(300);
  expect(stream.connection.get()).toBe("broken");
  const before = Socket.made.length;
  expect(before).toBe(3);
  // The system is back, with other tokens. The browser reports the same error as before.
  status = 401;
  made().onclose?.({ code: 1006 });
  await vi.advanceTimersByTimeAsync(60_000);
  expect(stream.connection.get()).toBe("out");
  expect(Socket.made).toHaveLength(before);
});

test("values that are watched at one rate are one subscription; one that nobody knows does not end the others", async () => {
  const values = new LiveValues(stream);
  made().opens();
  const told: unknown[] = [];
  values.watch("a", (reading, missing) => told.push(["a", reading?.value ?? null, missing !== null]));
  values.watch("b", (reading, missing) => told.push(["b", reading?.value ?? null, missing !== null]));
  await vi.runAllTicks();
  await Promise.resolve();
  const first = made().sent.at(-1);
  expect(first).toMatchObject({ subscribe: "svvs", names: ["a", "b"], every_ms: 100 });
  made().says({ id: first?.id, errors: [{ class: "UnknownName", message: "there is no SVV 'b'" }] });
  await Promise.resolve();
  const second = made().sent.at(-1);
  expect(second).toMatchObject({ subscribe: "svvs", names: ["a"] });
  made().says({ id: second?.id, svvs: { time_ns: 5, values: { a: { value: 0.5, number: 2, time_ns: 5 } } } });
  vi.advanceTimersByTime(1);
  expect(told).toEqual([
    ["b", null, true],
    ["a", 0.5, false],
  ]);
});
