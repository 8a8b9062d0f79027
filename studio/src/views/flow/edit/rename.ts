// SPDX-License-Identifier: Apache-2.0
// Renames parts of a verb and updates every reference. Blocks and sets of ports are in change.ts.
import type { Draft, Verb } from "./definition";

type VerbDraft = Draft & { kind: "verb" };

/** Renames a key of a table without changing its position. */
function keyed<T>(map: Record<string, T>, name: string, to: string): Record<string, T> {
  return Object.fromEntries(Object.entries(map).map(([key, value]) => [key === name ? to : key, value]));
}

function each<T>(map: Record<string, T>, change: (value: T) => T): Record<string, T> {
  return Object.fromEntries(Object.entries(map).map(([name, value]) => [name, change(value)]));
}

function with_(draft: VerbDraft, change: Partial<Verb>): VerbDraft {
  return { ...draft, of: { ...draft.of, ...change } };
}

/** Renames a condition, including in transitions. */
export function renameCondition(draft: VerbDraft, name: string, to: string): VerbDraft {
  const { conditions, transitions } = draft.of;
  return with_(draft, {
    conditions: keyed(conditions, name, to),
    transitions: transitions.map((line) => (line.condition === name ? { ...line, condition: to } : line)),
  });
}

/** Renames an output value, including in the conditions that return it. */
export function renameOutput(draft: VerbDraft, name: string, to: string): VerbDraft {
  const { conditions, output_values } = draft.of;
  const returned = (returns: string[] | null) => returns?.map((one) => (one === name ? to : one)) ?? null;
  return with_(draft, {
    output_values: keyed(output_values, name, to),
    conditions: each(conditions, (condition) => ({ ...condition, returns: returned(condition.returns) })),
  });
}

export function renameInput(draft: VerbDraft, name: string, to: string): VerbDraft {
  return with_(draft, { input_parameters: keyed(draft.of.input_parameters, name, to) });
}

/** Renames a member in the requirements of a start. */
export function renameRequirement(draft: VerbDraft, member: string, to: string): VerbDraft {
  return with_(draft, { requires: keyed(draft.of.requires ?? {}, member, to) });
}

/** Renames a command list, including in transitions, conditions, the initial list and the ending. */
export function renameList(draft: VerbDraft, name: string, to: string): VerbDraft {
  const { command_lists, conditions, transitions, initial, ending, layout } = draft.of;
  const list = (one: string) => (one === name ? to : one);
  return with_(draft, {
    command_lists: keyed(command_lists, name, to),
    transitions: transitions.map((line) => ({ ...line, from: list(line.from), to: list(line.to) })),
    conditions: each(conditions, (condition) => ({ ...condition, during: condition.during.map(list) })),
    initial: initial === null ? null : list(initial),
    ...(ending ? { ending: list(ending) } : {}),
    layout: keyed(layout, `list:${name}`, `list:${to}`),
  });
}

/**
 * Renames an object, including in instantiation parameters, which are bound to its members (`arm.commanded`), and in bounds of input
 * parameters.
 */
export function renameObject(draft: VerbDraft, name: string, to: string): VerbDraft {
  const { objects = {}, instantiation_parameters, input_parameters, layout } = draft.of;
  const member = (text: string) => text.replace(/^(-?)([^.]+)/, (whole, sign: string, one: string) => (one === name ? sign + to : whole));
  const members = <T>(map: Record<string, T>) => Object.fromEntries(Object.entries(map).map(([key, value]) => [member(key), value]));
  const places = Object.entries(layout).map(([what, at]) => [what.replace(/(?<=^instantiation_parameters:).*/, member), at] as const);
  const bound = (one: number | string) => (typeof one === "string" ? member(one) : one);
  return with_(draft, {
    objects: keyed(objects, name, to),
    instantiation_parameters: members(instantiation_parameters),
    input_parameters: each(input_parameters, (input) => ({
      ...input,
      ...(input.within ? { within: [bound(input.within[0]), bound(input.within[1])] as [number | string, number | string] } : {}),
      ...(input.counted_from ? { counted_from: member(input.counted_from) } : {}),
    })),
    ...(draft.of.requires
      ? { requires: each(members(draft.of.requires), (one) => (one.when ? { ...one, when: member(one.when) } : one)) }
      : {}),
    layout: Object.fromEntries(places),
  });
}
