// SPDX-License-Identifier: Apache-2.0
// The worker of the scope: receives the frames, stores the values, draws. The page only shows its pictures and stays responsive.
import { setTexts, tr } from "../../../language/text";
import type { FromWorker, Into, Show, ToWorker } from "../messages";
import { Acquisition } from "./acquisition";
import { exported } from "./exporting";
import { Picture } from "./picture";
import { Beside, Reference } from "./traces";

/** Minimum interval between two pictures, and between two measurements, ms. */
const PICTURE_MS = 40;
const MEASURE_MS = 250;

const acquisition = new Acquisition();
/** Value stores of recordings, by destination. */
const stores: Record<Into, Acquisition> = {
  shown: acquisition,
  beside: new Acquisition(),
  whole: new Acquisition(),
  wholeBeside: new Acquisition(),
  file: new Acquisition(),
};
const picture = new Picture(acquisition, stores.whole);
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
    case "texts":
      setTexts(said.texts, said.language);
      break;
    case "subscribed":
      acquisition.subscribed(said.subscription, said.channels);
      say({ kind: "channels", channels: [...acquisition.channels.values()].map(({ about }) => about) });
      break;
    case "frame":
      acquisition.frame(said.subscription, said.buffer);
      break;
    case "past":
      stores[said.into].past(said.begins, said.channels, said.runs, said.sums);
      if (said.begins && said.into === "shown") say({ kind: "channels", channels: said.channels });
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
    case "beside":
      picture.reference = said.shift_ns === null ? null : new Beside(stores.beside, said.shift_ns);
      picture.wholeReference = said.shift_ns === null ? null : new Beside(stores.wholeBeside, said.shift_ns);
      if (said.shift_ns === null) for (const of of [stores.beside, stores.wholeBeside]) of.past(true, [], [], []);
      break;
    case "export":
      save(said)
        .then(say, (why) => say({ kind: "exported", number: said.number, blob: null, message: textOf(why) }))
        .finally(() => said.apart && stores.file.past(true, [], [], []));
      break;
  }
}

async function save(asked: Extract<ToWorker, { kind: "export" }>): Promise<FromWorker> {
  if (asked.format !== "svg") return await exported(asked.apart ? stores.file : acquisition, show?.traces ?? [], asked);
  const span = present();
  if (!show || !span) throw new Error(tr("scope.nothingToExportNoValuesReceived"));
  const blob = new Blob([picture.svg(show, span)], { type: "image/svg+xml" });
  return { kind: "exported", number: asked.number, blob, message: "" };
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

// Draws again if no further picture is due, so that the latest values are measured too.
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

// Reports an error, which may recur many times per second, only once.
function trouble(why: unknown): void {
  const message = textOf(why);
  if (message === told) return;
  told = message;
  say({ kind: "trouble", message });
}
