// SPDX-License-Identifier: Apache-2.0
// Changes of a draft, each of which returns a new draft: the previous one stays unchanged, so that it can be restored.

import type { Value } from "../../../control/shapes";
import { own } from "../../../design/own";
import type { Place } from "../drawing/drawing";
import type {
  BlockUse,
  Command,
  Draft,
  Graph,
  Layout,
  Mode,
  Requirement,
  SetKind,
  Sets,
  Termination,
  Transition,
  Verb,
  VerbObject,
} from "./definition";
import { SET_KINDS, setsOf } from "./definition";
import { type Faces, inner, sideOf, splitPort } from "./faces";
import { holdingOf } from "./reading";

/** A set of ports, which is one node of the data flow. */
export interface NamedSet {
  kind: SetKind;
  name: string;
  ports: string[];
}

export function allSets(draft: Draft): NamedSet[] {
  return SET_KINDS[draft.kind].flatMap((kind) => Object.entries(setsOf(draft, kind)).map(([name, ports]) => ({ kind, name, ports })));
}

export function setWith(draft: Draft, port: string): NamedSet | undefined {
  return allSets(draft).find((set) => set.ports.includes(port));
}

/** Returns `wanted`, with a number appended if that name is taken. */
export function freeName(wanted: string, taken: Iterable<string>): string {
  const names = new Set(taken);
  if (!names.has(wanted)) return wanted;
  for (let number = 2; ; number += 1) if (!names.has(`${wanted}${number}`)) return `${wanted}${number}`;
}

function with_<T extends Draft>(draft: T, change: Partial<T["of"]>): T {
  return { ...draft, of: { ...draft.of, ...change } };
}

function withSets(draft: Draft, kind: SetKind, sets: Sets): Draft {
  return with_(draft, { [kind]: sets } as Partial<Graph & Verb>);
}

export function addBlock(draft: Draft, use: BlockUse, wanted: string, at: Place): { draft: Draft; label: string } {
  const label = freeName(wanted, [...Object.keys(draft.of.blocks), ...allSets(draft).map((set) => set.name)]);
  const blocks = { ...draft.of.blocks, [label]: use };
  return { draft: place(with_(draft, { blocks }), label, at), label };
}

export function place(draft: Draft, what: string, at: Place): Draft {
  return with_(draft, { layout: { ...draft.of.layout, [what]: at } });
}

export function places(draft: Draft, layout: Layout): Draft {
  return with_(draft, { layout: { ...draft.of.layout, ...layout } });
}

/** Removes a block, with its wires and the commands and conditions that refer to it. */
export function removeBlock(draft: Draft, label: string): Draft {
  const { [label]: _gone, ...blocks } = draft.of.blocks;
  const { [label]: _place, ...layout } = draft.of.layout;
  const isOf = (port: string) => splitPort(port, draft.of.blocks)[0] === label;
  let next = with_(draft, {
    blocks,
    layout,
    ...(draft.of.modes ? { modes: filtered(draft.of.modes, (port) => !isOf(port)) } : {}),
  });
  if (next.kind === "graph" && next.of.divide) next = with_(next, { divide: filtered(next.of.divide, (one) => one !== label) });
  for (const { kind, name, ports } of allSets(draft)) {
    const left = ports.filter((port) => !isOf(port));
    if (left.length < ports.length) next = setPorts(next, kind, name, left);
  }
  if (next.kind === "graph") return next;
  const verb = next.of;
  const keep = (command: Command) => command.block !== label;
  const without = (command: Command): Command => ({
    ...command,
    ...(command.blocks ? { blocks: command.blocks.filter((one) => one !== label) } : {}),
    ...(command.conditions ? { conditions: command.conditions.filter((one) => !isOf(one)) } : {}),
  });
  const names = (sets: Record<string, string>) => Object.fromEntries(Object.entries(sets).filter(([, port]) => !isOf(port)));
  const ways = holdingOf(verb.suspend);
  return with_(next, {
    command_lists: each(verb.command_lists, (list) => ({ ...list, commands: list.commands.filter(keep).map(without) })),
    conditions: each(verb.conditions, (condition) => ({ ...condition, on: condition.on.filter((port) => !isOf(port)) })),
    input_parameters: each(verb.input_parameters, (input) => ({ ...input, targets: input.targets.filter((port) => !isOf(port)) })),
    output_values: names(verb.output_values),
    ...(ways ? { suspend: { holding: ways.filter((way) => !isOf(way.set) && !isOf(way.until)) } } : {}),
  });
}

/** Renames a block and all references to it. */
export function renameBlock(draft: Draft, label: string, to: string): Draft {
  if (to === label || to === "" || Object.hasOwn(draft.of.blocks, to)) return draft;
  const renamed = (port: string) => {
    const [of, rest] = splitPort(port, draft.of.blocks);
    return of === label && rest !== "" ? `${to}.${rest}` : port;
  };
  const keyed = <T>(map: Record<string, T>) =>
    Object.fromEntries(Object.entries(map).map(([name, value]) => [name === label ? to : name, value]));
  let next = with_(renamePorts(draft, renamed), { blocks: keyed(draft.of.blocks), layout: keyed(draft.of.layout) });
  if (next.kind === "graph" && next.of.divide) next = with_(next, { divide: keyed(next.of.divide) });
  if (next.kind === "graph") return next;
  const command = (one: Command): Command => ({
    ...one,
    ...(one.block === label ? { block: to } : {}),
    ...(one.blocks ? { blocks: one.blocks.map((name) => (name === label ? to : name)) } : {}),
  });
  return with_(next, { command_lists: each(next.of.command_lists, (list) => ({ ...list, commands: list.commands.map(command) })) });
}

/** Renames ports, parameters and conditions of blocks in all references to them. */
export function renamePorts(draft: Draft, renamed: (port: string) => string): Draft {
  let next = draft;
  if (draft.of.modes)
    next = with_(next, { modes: Object.fromEntries(Object.entries(draft.of.modes).map(([port, of]) => [renamed(port), of])) });
  for (const kind of SET_KINDS[draft.kind])
    next = withSets(
      next,
      kind,
      each(setsOf(draft, kind), (ports) => ports.map(renamed)),
    );
  if (next.kind === "graph") return next;
  const verb = next.of;
  const command = (one: Command): Command => (one.conditions ? { ...one, conditions: one.conditions.map(renamed) } : one);
  const ways = holdingOf(verb.suspend);
  return with_(next, {
    command_lists: each(verb.command_lists, (list) => ({ ...list, commands: list.commands.map(command) })),
    conditions: each(verb.conditions, (condition) => ({ ...condition, on: condition.on.map(renamed) })),
    input_parameters: each(verb.input_parameters, (input) => ({ ...input, targets: input.targets.map(renamed) })),
    output_values: each(verb.output_values, renamed),
    ...(ways ? { suspend: { holding: ways.map((way) => ({ ...way, set: renamed(way.set), until: renamed(way.until) })) } } : {}),
  });
}

/** Sets a port's mode; undefined restores the mode that its block declares. */
export function setMode(draft: Draft, port: string, mode: Mode | undefined): Draft {
  const rest = filtered(draft.of.modes ?? {}, (one) => one !== port);
  return with_(draft, { modes: mode === undefined ? rest : { ...draft.of.modes, [port]: mode } });
}

/** Sets the divisor of a block's rate relative to its graph; undefined restores the full rate. */
export function setDivide(draft: Draft, label: string, divide: number | undefined): Draft {
  if (draft.kind !== "graph") return draft;
  const rest = filtered(draft.of.divide ?? {}, (one) => one !== label);
  return with_(draft, { divide: divide === undefined ? rest : { ...draft.of.divide, [label]: divide } });
}

export function setConstant(draft: Draft, label: string, name: string, value: Value | undefined): Draft {
  const use = own(draft.of.blocks, label);
  if (!use) return draft;
  const { [name]: _before, ...rest } = use.constants;
  const constants = value === undefined ? rest : { ...rest, [name]: value };
  return with_(draft, { blocks: { ...draft.of.blocks, [label]: { ...use, constants } } });
}

/**
 * Wires an output to an input. Both end up in one set: the set of the output, if it has one, otherwise the set of the input, otherwise a
 * new cell. The input leaves its previous set, because an input has one writer. A boundary of the whole is identified by its set.
 */
export function connect(draft: Draft, from: string | NamedSet, to: string | NamedSet, faces: Faces): Draft {
  if (typeof to !== "string") {
    if (typeof from !== "string") return draft;
    const present = setWith(draft, from);
    // The boundary absorbs a whole cell, but only the one port of another boundary.
    const moved = present?.kind === "cells" ? present.ports : [from];
    const left = present?.ports.filter((port) => !moved.includes(port)) ?? [];
    const next = present ? setPorts(draft, present.kind, present.name, left) : draft;
    return setPorts(next, to.kind, to.name, [...new Set([...moved, ...to.ports])]);
  }
  const before = setWith(draft, to);
  const target = typeof from === "string" ? setWith(draft, from) : from;
  if (before && target && before.kind === target.kind && before.name === target.name) return draft;
  let next = draft;
  if (before) {
    const isOnlyRead = !before.ports.some((port) => isOutput(draft, port, faces));
    // A set without a writer is kept together: all its readers get the new writer.
    if (!target && isOnlyRead && before.kind !== "inputs")
      return setPorts(draft, before.kind, before.name, [from as string, ...before.ports]);
    next = setPorts(next, before.kind, before.name, without(before.ports, to));
  }
  if (target) return setPorts(next, target.kind, target.name, [...target.ports, to]);
  const [, port] = splitPort(from as string, draft.of.blocks);
  const taken = [...allSets(next).map((set) => set.name), ...Object.keys(draft.of.blocks)];
  return setPorts(next, "cells", freeName(port.replaceAll(".", "_"), taken), [from as string, to]);
}

/** Removes an input from its set; if a cell then has no readers, removes the whole cell. */
export function disconnect(draft: Draft, input: string, faces: Faces): Draft {
  const set = setWith(draft, input);
  if (!set) return draft;
  const left = without(set.ports, input);
  const isRead = left.some((port) => !isOutput(draft, port, faces));
  return setPorts(draft, set.kind, set.name, set.kind === "cells" && !isRead ? [] : left);
}

/** Removes a port from the set of this name. */
export function release(draft: Draft, kind: SetKind, name: string, port: string): Draft {
  return setPorts(draft, kind, name, without(setsOf(draft, kind)[name] ?? [], port), true);
}

export function addBoundary(draft: Draft, kind: SetKind, wanted: string, at: Place): Draft {
  const name = freeName(wanted, [...allSets(draft).map((set) => set.name), ...Object.keys(draft.of.blocks)]);
  return place(setPorts(draft, kind, name, [], true), `${kind}:${name}`, at);
}

export function removeSet(draft: Draft, kind: SetKind, name: string): Draft {
  const { [name]: _gone, ...sets } = setsOf(draft, kind);
  return withSets(draft, kind, sets);
}

export function renameSet(draft: Draft, kind: SetKind, name: string, to: string): Draft {
  if (to === "" || allSets(draft).some((set) => set.name === to)) return draft;
  const keyed = <T>(map: Record<string, T>, before: string, now: string) =>
    Object.fromEntries(Object.entries(map).map(([key, value]) => [key === before ? now : key, value]));
  const next = withSets(draft, kind, keyed(setsOf(draft, kind), name, to));
  return with_(next, { layout: keyed(next.of.layout, `${kind}:${name}`, `${kind}:${to}`) });
}

export function isOutput(draft: Draft, port: string, faces: Faces): boolean {
  const item = inner(draft.of, port, faces);
  return item !== undefined && sideOf(item) === "output";
}

function setPorts(draft: Draft, kind: SetKind, name: string, ports: string[], keepEmpty = kind !== "cells"): Draft {
  if (ports.length === 0 && !keepEmpty) return removeSet(draft, kind, name);
  return withSets(draft, kind, { ...setsOf(draft, kind), [name]: ports });
}

// ---- only for verbs

export function setList(draft: Draft, name: string, commands: Command[]): Draft {
  if (draft.kind !== "verb") return draft;
  return with_(draft, { command_lists: { ...draft.of.command_lists, [name]: { ...draft.of.command_lists[name], commands } } });
}

/** Removes a command list, with the transitions from and to it. */
export function removeList(draft: Draft, name: string): Draft {
  if (draft.kind !== "verb") return draft;
  const { [name]: _gone, ...command_lists } = draft.of.command_lists;
  const transitions = draft.of.transitions.filter((line) => line.from !== name && line.to !== name);
  return with_(draft, { command_lists, transitions, initial: draft.of.initial === name ? null : draft.of.initial });
}

export function setInitial(draft: Draft, name: string): Draft {
  return draft.kind === "verb" ? with_(draft, { initial: name }) : draft;
}

export function setCondition(draft: Draft, name: string, condition: Termination | null): Draft {
  if (draft.kind !== "verb") return draft;
  const { [name]: _before, ...rest } = draft.of.conditions;
  return with_(draft, { conditions: condition ? { ...draft.of.conditions, [name]: condition } : rest });
}

export function setTransition(draft: Draft, index: number, line: Transition | null): Draft {
  if (draft.kind !== "verb") return draft;
  const transitions = [...draft.of.transitions];
  if (line) transitions[index] = line;
  else transitions.splice(index, 1);
  return with_(draft, { transitions });
}

export function setInput(draft: Draft, name: string, input: Verb["input_parameters"][string] | null): Draft {
  if (draft.kind !== "verb") return draft;
  const { [name]: _before, ...rest } = draft.of.input_parameters;
  return with_(draft, { input_parameters: input ? { ...draft.of.input_parameters, [name]: input } : rest });
}

export function setOutput(draft: Draft, name: string, port: string | null): Draft {
  if (draft.kind !== "verb") return draft;
  const { [name]: _before, ...rest } = draft.of.output_values;
  return with_(draft, { output_values: port ? { ...draft.of.output_values, [name]: port } : rest });
}

export function setObject(draft: Draft, name: string, object: VerbObject | null): Draft {
  if (draft.kind !== "verb") return draft;
  const rest = filtered(draft.of.objects ?? {}, (one) => one !== name);
  return with_(draft, { objects: object ? { ...draft.of.objects, [name]: object } : rest });
}

export function setRequirement(draft: Draft, member: string, requirement: Requirement | null): Draft {
  if (draft.kind !== "verb") return draft;
  const rest = filtered(draft.of.requires ?? {}, (one) => one !== member);
  return with_(draft, { requires: requirement ? { ...draft.of.requires, [member]: requirement } : rest });
}

/** Sets properties of the whole verb: its ending, and its reaction to being suspended or cut off. */
export function setWhole(
  draft: Draft,
  whole: Partial<Pick<Verb, "ending" | "ending_limit_ns" | "suspend" | "if_cut_off" | "manual">>,
): Draft {
  return draft.kind === "verb" ? with_(draft, whole) : draft;
}

export function setText(draft: Draft, change: { name?: string; doc?: string }): Draft {
  return with_(draft, change);
}

function without(ports: string[], port: string): string[] {
  return ports.filter((one) => one !== port);
}

function filtered<T>(map: Record<string, T>, keep: (name: string) => boolean): Record<string, T> {
  return Object.fromEntries(Object.entries(map).filter(([name]) => keep(name)));
}

function each<T, U>(map: Record<string, T>, change: (value: T) => U): Record<string, U> {
  return Object.fromEntries(Object.entries(map).map(([name, value]) => [name, change(value)]));
}
