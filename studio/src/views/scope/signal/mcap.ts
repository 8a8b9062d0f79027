// SPDX-License-Identifier: Apache-2.0
import { McapWriter } from "@mcap/core";
import { truthValues } from "./components";
import { missingIn } from "./series";
import { type ExportedChannel, missingText, rows } from "./table";

/** A message of a channel, which Foxglove and PlotJuggler show as `NAME.value`. */
interface Message {
  value: unknown;
  number: number;
}

/**
 * Writes the values to an MCAP file, with a channel of JSON messages for each SVV or private cell, `{"value": …, "number": n}`, at the
 * time of each value. The metadata `missing` lists the missing values. `gpac.open_recording` reads the file like a recording.
 */
export async function mcap(
  channels: readonly ExportedChannel[],
  from_ns: number,
  to_ns: number,
  system: string,
): Promise<Uint8Array<ArrayBuffer>[]> {
  const parts: Uint8Array<ArrayBuffer>[] = [];
  let written = 0n;
  const writable = {
    async write(bytes: Uint8Array) {
      // The bytes are copied because the writer reuses its memory.
      parts.push(new Uint8Array(bytes));
      written += BigInt(bytes.byteLength);
    },
    position: () => written,
  };
  const writer = new McapWriter({ writable });
  await writer.start({ profile: "", library: "opengpac studio" });
  const ids: number[] = [];
  for (const channel of channels) ids.push(await register(writer, channel, system));
  const messages: { channel: number; time_ns: number; at: number }[] = [];
  rows(channels, from_ns, to_ns, (time_ns, indices) => {
    indices.forEach((at, channel) => {
      if (at !== null) messages.push({ channel, time_ns, at });
    });
  });
  const encoder = new TextEncoder();
  for (const { channel, time_ns, at } of messages) {
    const of = channels[channel] as ExportedChannel;
    const time = BigInt(time_ns);
    const data = encoder.encode(JSON.stringify(messageOf(of, at)));
    await writer.addMessage({
      channelId: ids[channel] as number,
      sequence: of.ring.number(at) >>> 0,
      logTime: time,
      publishTime: time,
      data,
    });
  }
  const missing = missingText(channels, from_ns, to_ns);
  await writer.addMetadata({ name: "missing", metadata: new Map(missing.map((line, i) => [String(i + 1), line])) });
  await writer.addMetadata({ name: "lost", metadata: lostOf(channels, from_ns, to_ns) });
  await writer.addMetadata({ name: "opengpac", metadata: aboutOf(system, messages[0]?.time_ns ?? from_ns) });
  await writer.end();
  return parts;
}

function aboutOf(system: string, begins_ns: number): Map<string, string> {
  return new Map([
    ["system", system],
    ["begins_ns", String(begins_ns)],
  ]);
}

/** Returns the number of lost values by channel, only for channels with losses. */
function lostOf(channels: readonly ExportedChannel[], from_ns: number, to_ns: number): Map<string, string> {
  const counts = channels.map(
    ({ name, ring }) => [name, missingIn(ring, from_ns, to_ns).reduce((sum, { lost }) => sum + lost, 0)] as const,
  );
  return new Map(counts.filter(([, lost]) => lost > 0).map(([name, lost]) => [name, String(lost)]));
}

async function register(writer: McapWriter, { name, type_text, unit }: ExportedChannel, system: string): Promise<number> {
  const schema = {
    type: "object",
    properties: { value: { description: `${type_text}${unit ? ` in ${unit}` : ""}` }, number: { type: "integer" } },
  };
  const data = new TextEncoder().encode(JSON.stringify(schema));
  const schemaId = await writer.registerSchema({ name: type_text, encoding: "jsonschema", data });
  const metadata = new Map([
    ["kind", name.includes(":") ? "cell" : "svv"],
    ["type", type_text],
    ["unit", unit ?? ""],
    ["system", system],
  ]);
  return writer.registerChannel({ topic: name, schemaId, messageEncoding: "json", metadata });
}

function messageOf({ ring, all, type_text }: ExportedChannel, at: number): Message {
  const number = ring.number(at);
  if (all.length === 1 && all[0] === "") {
    const value = ring.value(at, 0);
    return { value: type_text === "bool" ? value !== 0 : jsonNumber(value), number };
  }
  const whole: Tree = {};
  const truths = truthValues(type_text, all.length);
  all.forEach((name, i) => {
    const one = ring.value(at, i);
    put(whole, name.match(/\w+/g) ?? [], truths[i] ? one !== 0 : jsonNumber(one));
  });
  return { value: listed(whole), number };
}

interface Tree {
  [step: string]: Tree | number | string | boolean;
}

function put(tree: Tree, path: string[], value: number | string | boolean): void {
  const [step = "", ...rest] = path;
  if (rest.length === 0) tree[step] = value;
  else {
    const inner = (tree[step] ?? {}) as Tree;
    tree[step] = inner;
    put(inner, rest, value);
  }
}

// Numeric keys are indices of an array.
function listed(tree: Tree | number | string | boolean): unknown {
  if (typeof tree !== "object") return tree;
  const values = Object.entries(tree).map(([step, inner]) => [step, listed(inner)] as const);
  return values.every(([step]) => /^\d+$/.test(step)) ? values.map(([, inner]) => inner) : Object.fromEntries(values);
}

// JSON has neither NaN nor infinity.
function jsonNumber(value: number): number | string {
  return Number.isFinite(value) ? value : String(value);
}
