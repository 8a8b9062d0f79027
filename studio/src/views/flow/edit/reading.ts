// SPDX-License-Identifier: Apache-2.0
// Converts definitions of files and of the system, in short or long forms, to the form that the editor uses: docs/files.md.

import type { Value } from "../../../control/shapes";
import { durationNs } from "../../../design/quantities";
import { tr } from "../../../language/text";
import type { Place } from "../drawing/drawing";
import type {
  BlockUse,
  Command,
  Composition,
  Draft,
  Graph,
  Holding,
  InputParameter,
  Layout,
  Requirement,
  Sets,
  Termination,
  Transition,
  VerbObject,
} from "./definition";

type Loose = Record<string, unknown>;

/**
 * Reads a definition from a file, in short or long form, and adds all keys that the editor needs. Throws an `Error` that explains why it
 * is not a definition.
 */
export function draftOf(kind: Draft["kind"], name: string, written: unknown, graphs: Record<string, unknown> = {}): Draft {
  const given = object(written, `${kind} '${name}'`);
  const blocks = mapped(given.blocks, (use, label) => blockUse(use, tr("flow.blockLabelOfName", { label, name }), graphs));
  const common = { ...given, name, doc: text(given.doc), blocks, cells: sets(given.cells), layout: layout(given.layout) };
  if (kind === "graph") return { kind, of: { ...common, inputs: sets(given.inputs), outputs: sets(given.outputs) } };
  const { ending_limit, ...verb } = common as typeof common & { ending_limit?: unknown };
  return {
    kind,
    of: {
      ...verb,
      // Only files contain it as text.
      ...(ending_limit === undefined ? {} : { ending_limit_ns: time(ending_limit) }),
      ...(given.objects === undefined ? {} : { objects: mapped(given.objects, verbObject) }),
      ...(given.requires === undefined ? {} : { requires: mapped(given.requires, requirement) }),
      instantiation_parameters: sets(given.instantiation_parameters),
      input_parameters: mapped(given.input_parameters, inputParameter),
      output_values: (given.output_values as Record<string, string> | undefined) ?? {},
      command_lists: mapped(given.command_lists, commandList),
      initial: typeof given.initial === "string" ? given.initial : null,
      conditions: mapped(given.conditions, termination),
      transitions: (given.transitions as Transition[] | undefined) ?? [],
    },
  };
}

/** Reads a composition from a file, and adds all missing keys. Throws an `Error` that explains why it is not a composition. */
export function compositionOf(name: string, written: unknown): Composition {
  const given = object(written, tr("flow.compositionName", { name }));
  const steps = (given.transitions as unknown[] | undefined) ?? [];
  if (!Array.isArray(steps)) throw new Error(tr("flow.theTransitionsOfCompositionNameMust", { name }));
  return {
    ...given,
    name,
    doc: text(given.doc),
    parts: mapped(given.parts, (part, label) => {
      if (typeof part !== "string") throw new Error(tr("flow.partLabelOfNameMustBe", { label, name }));
      return part;
    }),
    transitions: steps.map((step) => {
      const line = object(step, tr("flow.aTransitionOfCompositionName", { name }));
      return {
        ...line,
        from: several(line.from),
        condition: typeof line.condition === "string" ? line.condition : null,
        to: text(line.to),
      };
    }),
    initial: typeof given.initial === "string" ? given.initial : null,
    rename: mapped(given.rename, text),
    preset: (given.preset as Record<string, Value> | undefined) ?? {},
    share: several(given.share),
    together: given.together === true,
    until: given.until === "all" ? "all" : "any",
    layout: layout(given.layout),
  };
}

/** Returns a definition from the system without its locations in source files. */
export function withoutSources(defined: unknown): unknown {
  if (Array.isArray(defined)) return defined.map(withoutSources);
  if (typeof defined !== "object" || defined === null) return defined;
  const isSource = (key: string, of: unknown) =>
    key === "place" && (of === null || (typeof of === "object" && "file" in of && "line" in of));
  const kept = Object.entries(defined).filter(([key, of]) => !isSource(key, of));
  return Object.fromEntries(kept.map(([key, of]) => [key, withoutSources(of)]));
}

/** Returns the blocks to be brought to rest before a verb is suspended; null if it is suspended immediately. */
export function holdingOf(suspend: unknown): Holding[] | null {
  const ways = typeof suspend === "object" && suspend !== null ? (suspend as { holding?: unknown }).holding : null;
  if (!Array.isArray(ways)) return null;
  return ways.map((way: Partial<Holding>) => ({ ...way, set: text(way?.set), until: text(way?.until) }));
}

function blockUse(use: unknown, what: string, graphs: Record<string, unknown>): BlockUse {
  if (typeof use === "string") return blockUse({ block: use }, what, graphs);
  const given = object(use, what);
  const constants = (given.constants as Record<string, Value> | undefined) ?? {};
  if (typeof given.block === "string") {
    const name = given.block;
    // A name without a dot is a graph in the file.
    if (name.includes(".")) return { ...given, block: { subroutine: name }, constants };
    if (!Object.hasOwn(graphs, name)) throw new Error(tr("flow.whatThisFileHasNoGraph", { what, name }));
    return { ...given, block: { graph: graphOf(name, graphs[name], graphs) }, constants };
  }
  const block = object(given.block, what);
  if (typeof block.subroutine === "string") return blockUse({ ...given, block: block.subroutine }, what, graphs);
  const inner = object(block.graph, what);
  return { ...given, block: { graph: graphOf(text(inner.name) || what, inner, graphs) }, constants };
}

function graphOf(name: string, written: unknown, graphs: Record<string, unknown>): Graph {
  const draft = draftOf("graph", name, written, graphs);
  if (draft.kind !== "graph") throw new Error(tr("flow.nameIsNotAGraph", { name }));
  return draft.of;
}

function verbObject(written: unknown, name: string): VerbObject {
  if (typeof written === "string") return { device_type: written, each: false };
  const given = object(written, tr("flow.objectName", { name }));
  return { ...given, device_type: text(given.device_type), each: given.each === true };
}

function requirement(written: unknown, member: string): Requirement {
  if (typeof written === "string") return { raises: written };
  const given = object(written, tr("flow.theRequirementOfMember", { member }));
  return { ...given, raises: text(given.raises) };
}

function inputParameter(written: unknown): InputParameter {
  if (typeof written === "string" || Array.isArray(written)) return { targets: several(written), default: null, unit: "", tunable: false };
  const given = object(written, tr("flow.anInputParameter"));
  return {
    ...given,
    targets: several(given.targets),
    default: (given.default as Value | undefined) ?? null,
    unit: text(given.unit),
    tunable: given.tunable === true,
  };
}

function commandList(written: unknown): { commands: Command[] } {
  const commands = Array.isArray(written) ? written : ((object(written, tr("flow.aCommandList")).commands as unknown[] | undefined) ?? []);
  return { commands: commands.map(command) };
}

function command(written: unknown): Command {
  const given = object(written, tr("flow.aCommand"));
  if (typeof given.command === "string") return given as unknown as Command;
  const { every, budget, ...rest } = given;
  if (typeof rest.activate === "string") {
    const { activate, ...more } = rest;
    return {
      ...more,
      command: "activate",
      block: activate,
      every_ns: time(every),
      ...(budget === undefined ? {} : { budget_ns: time(budget) }),
    };
  }
  if (typeof rest.execute === "string") return { command: "execute", block: rest.execute };
  if (typeof rest.deactivate === "string") return { command: "deactivate", block: rest.deactivate };
  if (rest.install !== undefined) return { command: "install", blocks: several(rest.install) };
  if (rest.ready === true) return { command: "ready" };
  if (rest.wait === true) return { command: "wait" };
  if (typeof rest.wait === "string" && timeOrNull(rest.wait) !== null) return { command: "wait", time_ns: timeOrNull(rest.wait) };
  if (rest.wait !== undefined) return { command: "wait", conditions: several(rest.wait) };
  throw new Error(tr("flow.isNotACommand", { value: JSON.stringify(written) }));
}

function termination(written: unknown): Termination {
  if (typeof written === "string" || Array.isArray(written)) {
    return { on: several(written), returns: null, raises: false, during: [], priority: 0 };
  }
  const given = object(written, tr("flow.aCondition"));
  return {
    ...given,
    on: several(given.on),
    returns: given.returns === undefined || given.returns === null ? null : several(given.returns),
    raises: typeof given.raises === "string" ? given.raises : Boolean(given.raises),
    during: several(given.during),
    priority: Number(given.priority ?? 0),
  };
}

/** Converts "20 ms" to ns; returns null for any other text. */
export function timeOrNull(written: unknown): number | null {
  return typeof written === "string" ? (durationNs(written).value ?? null) : null;
}

function time(written: unknown): number | null {
  if (written === undefined || written === null) return null;
  const ns = timeOrNull(written);
  if (ns === null) throw new Error(tr("flow.writtenIsNotADurationWrite", { written: String(written) }));
  return ns;
}

function object(given: unknown, what: string): Loose {
  if (typeof given === "object" && given !== null && !Array.isArray(given)) return given as Loose;
  throw new Error(tr("flow.whatMustBeAnObject", { what }));
}

function text(given: unknown): string {
  return typeof given === "string" ? given : "";
}

function several(given: unknown): string[] {
  if (given === undefined || given === null) return [];
  return Array.isArray(given) ? given.map(String) : [String(given)];
}

function sets(given: unknown): Sets {
  return mapped(given, several);
}

function layout(given: unknown): Layout {
  const places = Object.entries((given as Record<string, Place> | undefined) ?? {});
  return Object.fromEntries(places.filter(([, place]) => Number.isFinite(place?.x) && Number.isFinite(place?.y)));
}

function mapped<T>(given: unknown, each: (value: unknown, name: string) => T): Record<string, T> {
  return Object.fromEntries(Object.entries((given as Loose | undefined) ?? {}).map(([name, value]) => [name, each(value, name)]));
}
