// SPDX-License-Identifier: Apache-2.0
// Definitions of graphs and verbs in the form of the real-time system and of files: docs/files.md. All changes are values.
import type { Value } from "../../../control/shapes";
import type { Place } from "../drawing/drawing";

export interface BlockUse {
  block: { subroutine: string } | { graph: Graph };
  constants: Record<string, Value>;
}

export type Sets = Record<string, string[]>;

export interface Layout {
  [what: string]: Place;
}

/** Relation between a port's values and its block's invocations, if it differs from the mode that the block declares. */
export type Mode = "synchronous" | "asynchronous" | { ratio: number };

export interface Graph {
  name: string;
  doc: string;
  blocks: Record<string, BlockUse>;
  inputs: Sets;
  outputs: Sets;
  cells: Sets;
  modes?: Record<string, Mode>;
  /** Divisors of blocks that run at a fraction of the graph's rate. */
  divide?: Record<string, number>;
  layout: Layout;
  [more: string]: unknown;
}

export interface Command {
  command: "install" | "execute" | "activate" | "deactivate" | "wait" | "ready";
  block?: string;
  blocks?: string[];
  every_ns?: number | null;
  conditions?: string[];
  time_ns?: number | null;
  [more: string]: unknown;
}

export interface Termination {
  on: string[];
  returns: string[] | null;
  /** True if the condition is an error, or the name of its exception class. */
  raises: boolean | string;
  during: string[];
  priority: number;
  /** Code of the alarm that the condition raises. */
  alarm?: string | null;
  [more: string]: unknown;
}

export interface Transition {
  from: string;
  condition: string;
  to: string;
}

export interface InputParameter {
  targets: string[];
  default: Value;
  unit: string;
  tunable: boolean;
  /** Minimum and maximum value: numbers, or parameters of an object, `-arm.max_speed`. */
  within?: [Bound, Bound] | null;
  /** SVV whose value is added to a relative value before the range is checked. */
  counted_from?: string | null;
  [more: string]: unknown;
}

export type Bound = number | string;

/** A logical device on which the verb acts, or several devices of the type. */
export interface VerbObject {
  device_type: string;
  each: boolean;
  [more: string]: unknown;
}

/** Property that a member of an object must have when the verb starts. */
export interface Requirement {
  /** Exception class raised by a start if the requirement is not met. */
  raises: string;
  /** Member that must be true for the requirement to apply. */
  when?: string | null;
  remedy?: string;
  [more: string]: unknown;
}

export interface Verb {
  name: string;
  doc: string;
  blocks: Record<string, BlockUse>;
  objects?: Record<string, VerbObject>;
  modes?: Record<string, Mode>;
  requires?: Record<string, Requirement>;
  ending?: string | null;
  ending_limit_ns?: number | null;
  suspend?: unknown;
  if_cut_off?: string | null;
  manual?: boolean;
  instantiation_parameters: Sets;
  cells: Sets;
  input_parameters: Record<string, InputParameter>;
  output_values: Record<string, string>;
  command_lists: Record<string, { commands: Command[] }>;
  initial: string | null;
  conditions: Record<string, Termination>;
  transitions: Transition[];
  layout: Layout;
  [more: string]: unknown;
}

/** Blocks to be brought to rest before a verb is suspended: `set` becomes true, then the verb waits for `until`. */
export interface Holding {
  set: string;
  until: string;
  [more: string]: unknown;
}

/** A graph or verb in the editor. */
export type Draft = { kind: "graph"; of: Graph } | { kind: "verb"; of: Verb };

/** A transition of a composition: from parts or lists to a part or a list. */
export interface Step {
  from: string[];
  /** Condition of the part; null for every normal end except a halt. */
  condition: string | null;
  to: string;
  [more: string]: unknown;
}

/** A verb composed of verbs. */
export interface Composition {
  name: string;
  doc: string;
  /** Label of each part → name of a verb or a composition. */
  parts: Record<string, string>;
  transitions: Step[];
  initial: string | null;
  /** `part.name` → name in the composed verb. */
  rename: Record<string, string>;
  /** `part.input` → constant value. */
  preset: Record<string, Value>;
  share: string[];
  together: boolean;
  until: "any" | "all";
  layout: Layout;
  [more: string]: unknown;
}

/** A composition in the editor, with the verbs and compositions of its parts. */
export interface ComposedDefinition {
  kind: "composition";
  of: Composition;
  made_of: Record<string, Part>;
}

/** Verb or composition that serves as a part. */
export type Part = { kind: "verb"; of: Verb } | { kind: "composition"; of: Composition };

/** Definition in the editor. */
export type DrawnDefinition = Draft | ComposedDefinition;

export const FORMAT = "opengpac-definitions";
export const VERSION = 1;

export function newGraph(name: string): Draft {
  return { kind: "graph", of: { name, doc: "", blocks: {}, inputs: {}, outputs: {}, cells: {}, layout: {} } };
}

export function newVerb(name: string): Draft {
  const of: Verb = {
    name,
    doc: "",
    blocks: {},
    instantiation_parameters: {},
    cells: {},
    input_parameters: {},
    output_values: {},
    command_lists: { start: { commands: [] } },
    initial: null,
    conditions: {},
    transitions: [],
    layout: {},
  };
  return { kind: "verb", of };
}

export function newComposition(name: string, made_of: Record<string, Part>): ComposedDefinition {
  const of: Composition = {
    name,
    doc: "",
    parts: {},
    transitions: [],
    initial: null,
    rename: {},
    preset: {},
    share: [],
    together: false,
    until: "any",
    layout: {},
  };
  return { kind: "composition", of, made_of };
}

/** Kinds of sets of ports; each set is one node of the data flow. */
export type SetKind = "inputs" | "outputs" | "cells" | "instantiation_parameters";

export const SET_KINDS: Record<Draft["kind"], SetKind[]> = {
  graph: ["inputs", "outputs", "cells"],
  verb: ["instantiation_parameters", "cells"],
};

export function setsOf(draft: Draft, kind: SetKind): Sets {
  return ((draft.of as Record<string, unknown>)[kind] as Sets | undefined) ?? {};
}

/** Returns the definition in the format that calls of the system accept, without the layout of the drawing. */
export function definitionOf(draft: Draft): Record<string, unknown> {
  const { layout: _drawing, ...definition } = draft.of;
  return definition;
}
