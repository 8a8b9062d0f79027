// SPDX-License-Identifier: Apache-2.0
import { tr } from "../../../language/text";
import type { FromWorker, ShownTrace, ToWorker } from "../messages";
import { csv } from "../signal/csv";
import type { ExportedChannel } from "../signal/table";
import type { Acquisition } from "./acquisition";

type ExportRequest = Extract<ToWorker, { kind: "export" }>;

/** Creates the file: CSV contains the shown components, MCAP whole channels. Derived traces are not exported. */
export async function exported(acquisition: Acquisition, traces: readonly ShownTrace[], asked: ExportRequest): Promise<FromWorker> {
  const channels = chosen(acquisition, traces);
  if (channels.length === 0) throw new Error(tr("scope.nothingToExportNoTraceHas"));
  const parts = asked.format === "csv" ? [...csv(channels, asked.from_ns, asked.to_ns)] : await mcapParts(channels, asked);
  const type = asked.format === "csv" ? "text/csv" : "application/octet-stream";
  return { kind: "exported", number: asked.number, blob: new Blob(parts, { type }), message: "" };
}

// Loaded on first use.
async function mcapParts(channels: ExportedChannel[], asked: ExportRequest): Promise<Uint8Array<ArrayBuffer>[]> {
  const { mcap } = await import("../signal/mcap");
  return mcap(channels, asked.from_ns, asked.to_ns, asked.system);
}

function chosen(acquisition: Acquisition, traces: readonly ShownTrace[]): ExportedChannel[] {
  const made = new Map<string, ExportedChannel>();
  for (const { setup } of traces) {
    const kept = acquisition.channels.get(setup.channel);
    const index = kept ? kept.components.indexOf(setup.component ?? "") : -1;
    if (!kept || index < 0) continue;
    const { about, ring } = kept;
    const one = made.get(about.name) ?? {
      name: about.name,
      type_text: about.type_text,
      unit: about.unit,
      ring,
      components: [],
      all: kept.components,
    };
    if (!one.components.some((component) => component.index === index)) one.components.push({ name: setup.component ?? "", index });
    made.set(about.name, one);
  }
  return [...made.values()];
}
