// SPDX-License-Identifier: Apache-2.0
// Tries a graph on the running system: a verb around it, SVVs for its ports, a running instance.
import type { Control } from "../../../control/control";
import type { Value, VerbRequest } from "../../../control/shapes";
import { type Draft, definitionOf, type Graph } from "./definition";
import { type Faces, inner } from "./faces";
import type { Placement } from "./placement";

export interface TrialRequest {
  every_ns: number;
  /** Name of the interrupt source, such as `rtp0.fast`. */
  source: string;
  /** Sources of those blocks of the graph that run on other sources. */
  placement: Placement;
  /** For each input of the graph, an existing SVV or a constant value. */
  inputs: Record<string, { svv: string } | { value: Value }>;
}

export interface Trial {
  verb: string;
  instance: number;
  /** SVVs of the outputs. */
  outputs: string[];
}

const KEY = "opengpac.trial";
/** Label of the graph in the enclosing verb. */
const LABEL = "graph";

/** Stores the trial of this tab, so that it can be restored after a change of views or a reload. */
export function keepTrial(control: Control, trial: Trial | null): void {
  if (trial === null) sessionStorage.removeItem(KEY);
  else sessionStorage.setItem(KEY, JSON.stringify({ ...trial, run: control.version.run }));
}

/** Returns the trial of this tab; null if there is none, or if the system has restarted. */
export function keptTrial(control: Control): Trial | null {
  try {
    const { run, ...trial } = JSON.parse(sessionStorage.getItem(KEY) ?? "null") as Trial & { run: string };
    return run === control.version.run ? trial : null;
  } catch {
    return null;
  }
}

/** Returns a verb that only runs this graph: its single command list activates the graph. */
export function verbAround(graph: Graph, every_ns: number): Record<string, unknown> {
  const ports = [...Object.keys(graph.inputs), ...Object.keys(graph.outputs)];
  return {
    name: graph.name,
    doc: graph.doc,
    blocks: { [LABEL]: { block: { graph: definitionOf({ kind: "graph", of: graph }) }, constants: {} } },
    instantiation_parameters: Object.fromEntries(ports.map((port) => [port, [`${LABEL}.${port}`]])),
    command_lists: { start: { commands: [{ command: "activate", block: LABEL, every_ns }] } },
  };
}

/**
 * Installs a graph and starts it. If that fails, throws `RefusalError`; the definition and SVVs are then kept, but an instance that was
 * not started is deleted.
 */
export async function begin(control: Control, draft: Draft & { kind: "graph" }, faces: Faces, wanted: TrialRequest): Promise<Trial> {
  const graph = draft.of;
  const pressed = control.pressed();
  const there = new Set((await control.look("names", {})).svvs);
  const named: Record<string, { svv: string }> = {};
  for (const [port, bound] of [...Object.entries(graph.inputs), ...Object.entries(graph.outputs)]) {
    const given = wanted.inputs[port];
    const svv = given && "svv" in given ? given.svv : `${graph.name}.${port}`;
    named[port] = { svv };
    const item = bound.map((name) => inner(graph, name, faces)).find((one) => one !== undefined);
    if (!there.has(svv))
      await control.order("svv", {
        name: svv,
        type_text: item?.type_text ?? "double",
        unit: item?.unit ?? "",
        types: typesOf(graph, faces),
      });
    if (given && "value" in given) await control.order("write", { name: svv, value: given.value });
  }
  // The drawn definition is in JSON form; the system reports errors in it.
  await control.order("define_verb", verbAround(graph, wanted.every_ns) as unknown as VerbRequest);
  const placed = Object.fromEntries(Object.entries(wanted.placement).map(([label, source]) => [`${LABEL}.${label}`, source]));
  const instance = await control.order("create", { verb: graph.name, arguments: named, placement: { ...placed, "*": wanted.source } });
  try {
    await control.order("start", { instance }, undefined, pressed);
  } catch (why) {
    await control.order("delete", { instance });
    throw why;
  }
  return { verb: graph.name, instance, outputs: Object.keys(graph.outputs).map((port) => named[port]?.svv ?? port) };
}

/** Halts a trial and deletes its instance; its SVVs are kept. */
export async function end(control: Control, trial: Trial): Promise<void> {
  const state = await control.look("state", { instance: trial.instance });
  if (state === "running" || state === "suspended") await control.stop("halt", { instance: trial.instance });
  if (state !== "deleted") await control.order("delete", { instance: trial.instance });
}

function typesOf(graph: Graph, faces: Faces): Record<string, string> {
  const types: Record<string, string> = {};
  for (const use of Object.values(graph.blocks)) {
    if ("subroutine" in use.block) Object.assign(types, faces.get(use.block.subroutine)?.types ?? {});
    else Object.assign(types, typesOf(use.block.graph, faces));
  }
  return types;
}
