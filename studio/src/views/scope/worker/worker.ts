// SPDX-License-Identifier: Apache-2.0
// The worker of the scope: takes the frames, keeps the values, draws. The page shows its pictures and is free for the person.
import type { FromWorker, Show, ToWorker } from "../messages";
import { Acquisition } from "./acquisition";
import { exported } from "./exporting";
import { Picture } from "./picture";
import { Reference } from "./traces";

/** Between two pictures at the least, and between two measurements, ms. */
const PICTURE_MS = 40;
const MEASURE_MS = 250;

const acquisition = new Acquisition();
const picture = new Picture(acquisition);
const surface = new OffscreenCanvas(1, 1);
const canvas = surface.getContext("2d");

let show: Show | null = null;
let changed = false;
let unseen = false;
let drawn_at = 0;
let took_ms = 0;
let measured_at = 0;
let measuring: ReturnType<typeof setTimeout> | undefined;
let waiting: ReturnType<typeof setTimeout> | undefined;
let told = "";

self.onmessage = (message: MessageEvent<ToWorker>) => {
  try {
    take(message.data);
  } catch (why) {
    trouble(why);
  }
  if (changed) drawSoon();
};

function take(said: ToWorker): void {
  changed = true;
  switch (said.kind) {
    case "subscribed":
      acquisition.subscribed(said.subscription, said.channels);
      say({ kind: "channels", channels: [...acquisition.channels.values()].map(({ about }) => about) });
      break;
    case "frame":
      acquisition.frame(said.subscription, said.buffer);
      break;
    case "past":
      acquisition.past(said.begins, said.channels, said.runs, said.sums);
      if (said.begins) say({ kind: "channels", channels: said.channels });
      break;
    case "forget":
      acquisition.forget(said.channels);
      break;
    case "keep":
      acquisition.keep(said.keep_s * 1e9);
      break;
    case "sweep":
      acquisition.aim(said.mode, said.span_ns, said.pre_ns, said.trigger);
      break;
    case "arm":
      acquisition.arm();
      break;
    case "event":
      acquisition.event(said.time_ns);
      break;
    case "hold":
      acquisition.stop(said.hold);
      break;
    case "clear":
      acquisition.clear();
      break;
    case "show":
      show = said.show;
      measured_at = 0;
      break;
    case "seen":
      unseen = false;
      changed = false;
      drawSoon();
      break;
    case "reference": {
      const span = present();
      picture.reference = said.keep && show && span ? new Reference(acquisition, show.traces, span) : null;
      break;
    }
    case "export":
      exported(acquisition, show?.traces ?? [], said).then(say, (why) =>
        say({ kind: "exported", number: said.number, blob: null, message: textOf(why) }),
      );
      break;
  }
}

let dirty = false;

function drawSoon(): void {
  dirty ||= changed;
  changed = false;
  if (!dirty || unseen || waiting !== undefined) return;
  const wait = Math.max(PICTURE_MS, 2 * took_ms) - (performance.now() - drawn_at);
  waiting = setTimeout(
    () => {
      waiting = undefined;
      dirty = false;
      draw();
    },
    Math.max(0, wait),
  );
}

function present() {
  return show?.window ?? acquisition.sweep.span();
}

function draw(): void {
  if (!canvas || !show || show.width < 1 || show.height < 1) return;
  const begun = performance.now();
  const span = present();
  if (surface.width !== show.width || surface.height !== show.height) {
    surface.width = show.width;
    surface.height = show.height;
  }
  canvas.clearRect(0, 0, show.width, show.height);
  const scales = span ? picture.draw(canvas, show, span) : { ranges: {}, x: null };
  const measures = begun - measured_at >= MEASURE_MS;
  if (measures) measured_at = begun;
  else measureSoon(measured_at + MEASURE_MS - begun);
  const bitmap = surface.transferToImageBitmap();
  took_ms = performance.now() - begun;
  drawn_at = performance.now();
  unseen = true;
  say(
    {
      kind: "drawn",
      bitmap,
      span,
      ...scales,
      state: acquisition.sweep.state,
      triggers: acquisition.sweep.triggers,
      hold: acquisition.hold,
      rows: measures && span ? picture.rows(show, span) : null,
      counts: measures ? acquisition.counts() : null,
      has_reference: picture.reference !== null,
      draw_ms: took_ms,
    },
    [bitmap],
  );
}

// What came last is measured too, where nothing comes behind it that would be drawn.
function measureSoon(wait_ms: number): void {
  if (measuring !== undefined) return;
  measuring = setTimeout(() => {
    measuring = undefined;
    changed = true;
    drawSoon();
  }, wait_ms);
}

function say(message: FromWorker, transfer: Transferable[] = []): void {
  self.postMessage(message, { transfer });
}

function textOf(why: unknown): string {
  return why instanceof Error ? why.message : String(why);
}

// The same trouble twenty times a second is told once.
function trouble(why: unknown): void {
  const message = textOf(why);
  if (message === told) return;
  told = message;
  say({ kind: "trouble", message });
}
