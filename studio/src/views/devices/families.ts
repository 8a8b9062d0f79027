// SPDX-License-Identifier: Apache-2.0
import type { Configuration, DeviceState, DeviceType, SvvSpecification } from "../../control/shapes";

/** Logical devices of one type with a common prefix: the joints of an arm. */
export interface DeviceFamily {
  /** Prefix, such as `ur5e`; the type name if the names have no prefix. */
  name: string;
  type: DeviceType;
  devices: string[];
}

export function familiesOf(configuration: Configuration): DeviceFamily[] {
  const found = new Map<string, DeviceFamily>();
  for (const [device, typeName] of Object.entries(configuration.logical_devices)) {
    const type = configuration.device_types[typeName];
    if (!type) continue;
    const name = device.includes(".") ? device.slice(0, device.lastIndexOf(".")) : typeName;
    const key = `${name} ${typeName}`;
    const family = found.get(key) ?? { name, type, devices: [] };
    family.devices.push(device);
    found.set(key, family);
  }
  return [...found.values()];
}

/** Returns the name of a device's SVV in the system: its own SVV, or the shared one. */
export function svvName(device: string, member: string, svv: SvvSpecification): string {
  return svv.shared ?? `${device}.${member}`;
}

/** Returns the SVVs to show in a table of several devices: the first `most` scalars that are not shared. */
export function columnsOf(type: DeviceType, most = 4): [string, SvvSpecification][] {
  return Object.entries(type.svvs)
    .filter(([, svv]) => svv.shared === null && !/[[{]/.test(svv.type_text))
    .slice(0, most);
}

export function shortName(device: string): string {
  return device.slice(device.lastIndexOf(".") + 1);
}

/** Returns whether the verb that keeps a device running is active and updates its values. */
export function isRenewed(state: DeviceState | undefined): boolean {
  return state !== undefined && state !== "disabled" && state !== "fault";
}
