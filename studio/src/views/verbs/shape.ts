// SPDX-License-Identifier: Apache-2.0
// Shape of a verb for its diagram, from an installed instance or from its definition.

import type { InstalledInstance } from "../../control/shapes";
import { period } from "../../design/numbers";
import { tr } from "../../language/text";

/** Part of a composed verb: a state that contains other states. */
export interface Superstate {
  name: string;
  /** The verb of the part; empty if unknown. */
  about: string;
  within: string | null;
}

export interface Shape {
  lists: { name: string; commands: string[]; part: string | null }[];
  parts: Superstate[];
  conditions: { name: string; of: string[]; raises: boolean; during: string[] }[];
  transitions: { from: string; condition: string; to: string }[];
  initial: string;
  ending: string | null;
}

/** Returns the shape of an instance. `parts` are the parts of its verb; if undefined, they are derived from the names of its lists. */
export function shapeOfInstance(instance: InstalledInstance, parts: Parts | undefined): Shape {
  const names = instance.lists.map((list) => list.name);
  return {
    ...withParts(instance.lists, parts ?? Object.fromEntries(names.flatMap(prefixes).map((name) => [name, { verb: "" }]))),
    conditions: instance.conditions.map(({ name, of, raises, during }) => ({ name, of, raises, during })),
    transitions: instance.transitions,
    initial: instance.initial,
    ending: instance.ending,
  };
}

/** A function block command, in the format of definitions. */
interface Command {
  command: string;
  block?: string;
  blocks?: string[];
  every_ns?: number | null;
  conditions?: string[];
  time_ns?: number | null;
}

/** Parts of a composed verb by label, including nested ones. */
export type Parts = Record<string, { verb: string }>;

interface Definition {
  parts?: Parts;
  command_lists?: Record<string, { commands: Command[] }>;
  initial?: string | null;
  ending?: string | null;
  conditions?: Record<string, { on?: string[]; raises?: boolean | string | null; during?: string | string[] }>;
  transitions?: { from: string; condition: string; to: string }[];
}

/** Returns the shape of a verb from its definition as JSON; null if the JSON is not a definition. */
export function shapeOfDefinition(defined: unknown): Shape | null {
  const definition = defined as Definition | null;
  if (!definition || typeof definition !== "object" || !definition.command_lists) return null;
  const isComposed = Object.keys(definition.parts ?? {}).length > 0;
  const lists = Object.entries(definition.command_lists).map(([name, list]) => ({ name, commands: list.commands.map(commandText) }));
  return {
    ...withParts(lists, definition.parts ?? {}),
    conditions: Object.entries(definition.conditions ?? {}).map(([key, { on, raises, during }]) => ({
      // In a composed verb, keys contain the label of the part; transitions and reports contain only the name.
      name: isComposed ? (key.split(".").at(-1) ?? key) : key,
      of: on ?? [],
      raises: Boolean(raises),
      during: typeof during === "string" ? [during] : (during ?? []),
    })),
    transitions: definition.transitions ?? [],
    initial: definition.initial ?? lists[0]?.name ?? "",
    ending: definition.ending ?? null,
  };
}

/** Returns the lists, each with its innermost part, and the parts that contain a list. */
export function withParts(lists: { name: string; commands: string[] }[], parts: Parts): Pick<Shape, "lists" | "parts"> {
  const innermost = (name: string) => prefixes(name).findLast((prefix) => Object.hasOwn(parts, prefix)) ?? null;
  const inParts = lists.map((list) => ({ ...list, part: innermost(list.name) }));
  const isUsed = (name: string) => lists.some((list) => list.name.startsWith(`${name}.`));
  const superstates = Object.entries(parts)
    .filter(([name]) => isUsed(name))
    .map(([name, { verb }]) => ({ name, about: verb, within: innermost(name) }));
  return { lists: inParts, parts: superstates };
}

/** Returns the enclosing prefixes of a name: "a" and "a.b" for "a.b.c". */
function prefixes(name: string): string[] {
  const words = name.split(".");
  return words.slice(1).map((_, at) => words.slice(0, at + 1).join("."));
}

/** Describes a command in the system's terminology. */
export function commandText(command: Command): string {
  if (command.command === "wait") {
    if (command.conditions?.length) return tr("verbs.waitForConditions", { conditions: command.conditions.join(` ${tr("verbs.or")} `) });
    return command.time_ns ? tr("verbs.waitTimeNs", { time_ns: period(command.time_ns) }) : tr("verbs.waitUntilNothingIsActive");
  }
  const every = command.every_ns ? ` ${tr("verbs.everyEveryNs", { every_ns: period(command.every_ns) })}` : "";
  return `${command.command} ${command.block ?? command.blocks?.join(", ") ?? ""}${every}`.trim();
}

/** An arrow of the diagram, from a list to another list or to the end (`to` is null). */
export interface Arrow {
  from: string;
  to: string | null;
  conditions: { name: string; raises: boolean }[];
}

/**
 * Returns the arrows: the transitions, and for each list the conditions that end the verb. Arrows between the same two states are
 * merged.
 */
export function arrowsOf(shape: Shape): Arrow[] {
  const arrows = new Map<string, Arrow>();
  const add = (from: string, to: string | null, name: string, raises = false) => {
    const key = `${from}\n${to ?? ""}`;
    const arrow = arrows.get(key) ?? { from, to, conditions: [] };
    arrows.set(key, arrow);
    if (!arrow.conditions.some((one) => one.name === name)) arrow.conditions.push({ name, raises });
  };
  for (const { from, condition, to } of shape.transitions) add(from, to, condition);
  for (const { name: list } of shape.lists) {
    for (const condition of shape.conditions) {
      // A condition of the system itself (`halted`, `time_limit`) can end every list, so it is drawn only as a transition.
      if (condition.of.length === 0) continue;
      if (condition.during.length > 0 && !condition.during.includes(list)) continue;
      if (shape.transitions.some((one) => one.from === list && one.condition === condition.name)) continue;
      add(list, null, condition.name, condition.raises);
    }
  }
  return [...arrows.values()];
}
