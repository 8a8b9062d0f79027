// SPDX-License-Identifier: Apache-2.0
// Arguments of a verb: the devices, SVVs and channels to choose from, and the values sent for a choice.
import type { Argument, Channel, Configuration, FormArgument, VerbForm } from "../../control/shapes";

/** Chosen names by argument; only a group may have more than one. */
export type Choices = Record<string, string[]>;

/** Returns the names that can be selected for each argument. */
export function choicesOf(form: VerbForm, configuration: Configuration | null): Record<string, string[]> {
  const options: Record<string, string[]> = {};
  for (const argument of form.arguments) options[argument.name] = configuration ? namesFor(argument, configuration) : [];
  return options;
}

function namesFor(argument: FormArgument, configuration: Configuration): string[] {
  if (argument.kind === "device" || argument.kind === "group") {
    const all = Object.entries(configuration.logical_devices);
    return all.filter(([, type]) => argument.of === null || type === argument.of).map(([name]) => name);
  }
  if (argument.kind === "svv") {
    const all = Object.entries(configuration.logical_devices);
    return all.flatMap(([device, type]) => Object.keys(configuration.device_types[type]?.svvs ?? {}).map((svv) => `${device}.${svv}`));
  }
  return Object.entries(configuration.physical_devices).flatMap(([device, { channels }]) => {
    const names = argument.members.length > 0 ? partsWith(channels, argument.members) : channels.map((channel) => channel.name);
    return names.map((name) => `${device}/${name}`);
  });
}

/** Returns the parts of a device that have all these channels: `elbow`, if `elbow.position` and `elbow.effort` exist. */
function partsWith(channels: Channel[], members: string[]): string[] {
  const names = new Set(channels.map((channel) => channel.name));
  const parts = [...new Set([...names].filter((name) => name.includes(".")).map((name) => name.slice(0, name.lastIndexOf("."))))];
  return parts.filter((part) => members.every((member) => names.has(`${part}.${member}`)));
}

/**
 * Returns the initial choices: for a group, all devices of the first family; for other arguments, a device or channel if it is the only
 * one.
 */
export function firstChoices(form: VerbForm, options: Record<string, string[]>): Choices {
  const first: Choices = {};
  for (const { name, kind } of form.arguments) {
    const names = options[name] ?? [];
    if (kind === "group") first[name] = families(names)[0]?.names ?? [];
    else if (kind !== "svv" && names.length === 1) first[name] = names;
  }
  return first;
}

/** Groups devices by their prefix: the joints of each arm. */
export function families(names: string[]): { family: string; names: string[] }[] {
  const found = new Map<string, string[]>();
  for (const name of names) {
    const family = name.includes(".") ? name.slice(0, name.lastIndexOf(".")) : "";
    found.set(family, [...(found.get(family) ?? []), name]);
  }
  return [...found].map(([family, members]) => ({ family, names: members }));
}

/** Returns the devices of the only group argument, in the order of the elements of array inputs. */
export function devicesOf(form: VerbForm, choices: Choices): string[] {
  const groups = form.arguments.filter((argument) => argument.kind === "group");
  const only = groups.length === 1 ? groups[0] : undefined;
  return only ? (choices[only.name] ?? []) : [];
}

/** Converts the choices to the arguments of the call `create`. */
export function argumentsOf(form: VerbForm, choices: Choices): Record<string, Argument> {
  const given: Record<string, Argument> = {};
  for (const { name, kind, members } of form.arguments) {
    const names = choices[name] ?? [];
    const only = names[0] ?? "";
    if (kind === "group") given[name] = { devices: names };
    else if (kind === "device") given[name] = { device: only };
    else if (kind === "svv") given[name] = only.includes(",") ? { svvs: only.split(",").map((one) => one.trim()) } : { svv: only.trim() };
    else {
      const at = only.indexOf("/");
      const [device, of] = [only.slice(0, at), only.slice(at + 1)];
      given[name] = members.length > 0 ? { part: { device, part: of } } : { channel: { device, channel: of } };
    }
  }
  return given;
}
