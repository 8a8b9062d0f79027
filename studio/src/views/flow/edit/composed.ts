// SPDX-License-Identifier: Apache-2.0
// Compositions in the editor: changes as values, the required names of their parts, and their state diagram.

import type { Value } from "../../../control/shapes";
import { tr } from "../../../language/text";
import { arrowsOf, commandText, type Shape } from "../../verbs/shape";
import { freeName } from "./change";
import { type ComposedDefinition, type Composition, definitionOf, type Part, type Step, type Verb } from "./definition";

function with_(composed: ComposedDefinition, change: Partial<Composition>): ComposedDefinition {
  return { ...composed, of: { ...composed.of, ...change } };
}

/** Returns a part; null if it does not exist. */
export function partOf(composed: ComposedDefinition, label: string): Part | null {
  const name = Object.hasOwn(composed.of.parts, label) ? composed.of.parts[label] : undefined;
  return name !== undefined && Object.hasOwn(composed.made_of, name) ? (composed.made_of[name] ?? null) : null;
}

export function addPart(composed: ComposedDefinition, name: string): { composed: ComposedDefinition; label: string } {
  const label = freeName(name.replaceAll(".", "_"), Object.keys(composed.of.parts));
  return { composed: with_(composed, { parts: { ...composed.of.parts, [label]: name } }), label };
}

export function setPart(composed: ComposedDefinition, label: string, name: string): ComposedDefinition {
  return with_(composed, { parts: { ...composed.of.parts, [label]: name } });
}

/** Removes a part, with its transitions, renamings and presets. */
export function removePart(composed: ComposedDefinition, label: string): ComposedDefinition {
  const { parts, transitions, initial, rename, preset } = composed.of;
  const keep = <T>(map: Record<string, T>) => Object.fromEntries(Object.entries(map).filter(([name]) => !isOf(name, label)));
  const steps = transitions.map((step) => ({ ...step, from: step.from.filter((from) => !isOf(from, label)) }));
  return with_(composed, {
    parts: Object.fromEntries(Object.entries(parts).filter(([name]) => name !== label)),
    transitions: steps.filter((step) => step.from.length > 0 && !isOf(step.to, label)),
    initial: initial !== null && isOf(initial, label) ? null : initial,
    rename: keep(rename),
    preset: keep(preset),
  });
}

/** Renames a part and all references to it. */
export function renamePart(composed: ComposedDefinition, label: string, to: string): ComposedDefinition {
  const { parts, transitions, initial, rename, preset } = composed.of;
  const renamed = (name: string) => (isOf(name, label) ? `${to}${name.slice(label.length)}` : name);
  const keyed = <T>(map: Record<string, T>) => Object.fromEntries(Object.entries(map).map(([name, value]) => [renamed(name), value]));
  return with_(composed, {
    parts: Object.fromEntries(Object.entries(parts).map(([name, of]) => [name === label ? to : name, of])),
    transitions: transitions.map((step) => ({ ...step, from: step.from.map(renamed), to: renamed(step.to) })),
    initial: initial === null ? null : renamed(initial),
    rename: keyed(rename),
    preset: keyed(preset),
  });
}

export function setStep(composed: ComposedDefinition, index: number, step: Step | null): ComposedDefinition {
  const transitions = [...composed.of.transitions];
  if (step) transitions[index] = step;
  else transitions.splice(index, 1);
  return with_(composed, { transitions });
}

/** Sets the name that an item of a part has in the composed verb; an empty string restores the name that it has in the part. */
export function setRename(composed: ComposedDefinition, name: string, to: string): ComposedDefinition {
  const { [name]: _before, ...rest } = composed.of.rename;
  return with_(composed, { rename: to === "" ? rest : { ...composed.of.rename, [name]: to } });
}

/** Sets a constant value for an input of a part; undefined makes it a parameter again. */
export function setPreset(composed: ComposedDefinition, name: string, value: Value | undefined): ComposedDefinition {
  const { [name]: _before, ...rest } = composed.of.preset;
  return with_(composed, { preset: value === undefined ? rest : { ...composed.of.preset, [name]: value } });
}

export function setComposition(
  composed: ComposedDefinition,
  change: Partial<Pick<Composition, "initial" | "share" | "together" | "until" | "name" | "doc">>,
): ComposedDefinition {
  return with_(composed, change);
}

function isOf(name: string, label: string): boolean {
  return name === label || name.startsWith(`${label}.`);
}

/** Names of a part's items, which can be changed in the composed verb. */
export interface Names {
  objects: string[];
  parameters: string[];
  inputs: string[];
  outputs: string[];
  conditions: string[];
}

export function namesOf(part: Part | null, made_of: ComposedDefinition["made_of"], depth = 0): Names {
  if (!part || depth > DEPTH_MAX) return { objects: [], parameters: [], inputs: [], outputs: [], conditions: [] };
  if (part.kind === "verb") {
    const { objects = {}, instantiation_parameters, input_parameters, output_values, conditions } = part.of;
    const ofObject = (name: string) => Object.hasOwn(objects, name.split(".")[0] ?? "");
    return {
      objects: Object.keys(objects),
      parameters: Object.keys(instantiation_parameters).filter((name) => !ofObject(name)),
      inputs: Object.keys(input_parameters),
      outputs: Object.keys(output_values),
      conditions: Object.keys(conditions),
    };
  }
  const inner = Object.entries(part.of.parts).map(([label, name]) => ({
    label,
    names: namesOf(Object.hasOwn(made_of, name) ? (made_of[name] ?? null) : null, made_of, depth + 1),
  }));
  const called = (kind: keyof Names) => [
    ...new Set(
      inner.flatMap(({ label, names }) =>
        names[kind]
          .filter((name) => !Object.hasOwn(part.of.preset, `${label}.${name}`))
          .map((name) => part.of.rename[`${label}.${name}`] ?? name),
      ),
    ),
  ];
  return {
    objects: called("objects"),
    parameters: called("parameters"),
    inputs: called("inputs"),
    outputs: called("outputs"),
    conditions: called("conditions"),
  };
}

/** Maximum nesting depth of parts; a greater depth indicates a cycle. */
const DEPTH_MAX = 20;
/** Label in the drawing for a transition at every normal end. */
export const DONE = tr("flow.everyNormalEnd");

interface Inside {
  lists: Shape["lists"];
  parts: Shape["parts"];
  conditions: Shape["conditions"];
  transitions: Shape["transitions"];
  /** Initial state. */
  initial: string;
}

/** Returns the state diagram of a composition: its parts as states that contain their command lists. */
export function shapeOfComposition(composed: ComposedDefinition): Shape {
  return { ...inside(composed.of, composed.made_of, "", 0), ending: null };
}

function inside(of: Composition, made_of: ComposedDefinition["made_of"], prefix: string, depth: number): Inside {
  const made: Inside = { lists: [], parts: [], conditions: [], transitions: [], initial: "" };
  const within = prefix === "" ? null : prefix.slice(0, -1);
  for (const [label, name] of Object.entries(of.parts)) {
    const own = `${prefix}${label}`;
    const part = Object.hasOwn(made_of, name) ? made_of[name] : undefined;
    made.parts.push({ name: own, about: name, within });
    if (!part || depth > DEPTH_MAX) continue;
    const inner = part.kind === "verb" ? ofVerb(part.of, own) : inside(part.of, made_of, `${own}.`, depth + 1);
    for (const key of ["lists", "parts", "conditions", "transitions"] as const) (made[key] as unknown[]).push(...inner[key]);
  }
  const steps = of.transitions.flatMap(({ from, condition, to }) =>
    from.map((one) => ({ from: `${prefix}${one}`, condition: condition ?? DONE, to: `${prefix}${to}` })),
  );
  made.transitions.push(...steps);
  // A condition that has a transition no longer ends the composition.
  const isCovered = (list: string, { name, raises }: Shape["conditions"][number]) =>
    steps.some((step) => isOf(list, step.from) && (step.condition === name || (step.condition === DONE && !raises)));
  made.conditions = made.conditions
    .map((condition) => ({ ...condition, during: condition.during.filter((list) => !isCovered(list, condition)) }))
    .filter((condition) => condition.during.length > 0);
  const first = of.initial ?? Object.keys(of.parts)[0];
  made.initial = of.together || first === undefined ? "" : `${prefix}${first}`;
  return made;
}

function ofVerb(verb: Verb, part: string): Inside {
  const lists = Object.entries(verb.command_lists).map(([name, { commands }]) => ({
    name: `${part}.${name}`,
    commands: commands.map(commandText),
    part,
  }));
  const conditions = Object.entries(verb.conditions).map(([name, { on, raises, during }]) => ({
    name,
    of: on,
    raises: Boolean(raises),
    during: (during.length > 0 ? during : Object.keys(verb.command_lists)).map((list) => `${part}.${list}`),
  }));
  const transitions = verb.transitions.map(({ from, condition, to }) => ({ from: `${part}.${from}`, condition, to: `${part}.${to}` }));
  return { lists, parts: [], conditions, transitions, initial: `${part}.${verb.initial ?? Object.keys(verb.command_lists)[0] ?? ""}` };
}

/** Returns the names of the parts and lists that transitions can connect. */
export function statesOf(composed: ComposedDefinition): string[] {
  const { parts, lists } = shapeOfComposition(composed);
  return [...parts, ...lists].map(({ name }) => name);
}

/** Returns the conditions by which these states can be left; if `from` is empty, the conditions of all parts. */
export function conditionsFrom(composed: ComposedDefinition, from: readonly string[]): string[] {
  const labels = from.length > 0 ? from.map((one) => one.split(".")[0] ?? one) : Object.keys(composed.of.parts);
  const own = labels.flatMap((label) =>
    namesOf(partOf(composed, label), composed.made_of).conditions.map((name) => composed.of.rename[`${label}.${name}`] ?? name),
  );
  return [...new Set([...own, "completed", "fault", "halted"])];
}

/** Returns the transition for an arrow drawn between two states, at the first condition that ends `from` and has no transition yet. */
export function drawnStep(composed: ComposedDefinition, from: string, to: string): Step {
  const ends = arrowsOf(shapeOfComposition(composed)).filter((arrow) => arrow.to === null && isOf(arrow.from, from));
  return { from: [from], condition: ends[0]?.conditions[0]?.name ?? null, to };
}

/** Converts a composition, without its parts, to arguments of the call `compose`. */
export function askedOf(of: Composition): Record<string, unknown> {
  const { name, doc, transitions, initial, rename, preset, share, together, until } = of;
  return { name, doc, transitions, initial, rename, preset, share, together, until };
}

/** Returns the verb of a part in the format that calls accept. */
export function verbOf(part: Part & { kind: "verb" }): Record<string, unknown> {
  return definitionOf(part);
}
