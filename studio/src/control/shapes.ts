// SPDX-License-Identifier: Apache-2.0
// What the control interface answers: docs/control.md, crates/control/schemas.

export type Role = "observe" | "operate" | "configure" | "download";
export type Mode = "automatic" | "manual";
/** A value of an SVV, a parameter or a report: a number, a truth, an array, a struct. */
export type Value = number | boolean | string | null | Value[] | { [member: string]: Value };

export interface Version {
  opengpac: string;
  interface: number;
  target: string;
  system: string;
  clock: "monotonic" | "virtual";
  role?: Role;
}

export interface SessionInfo {
  name: string;
  who: string;
  role: Role;
  from: string;
  commands: boolean;
  alive: boolean;
  held: boolean;
  kept_reports: number;
}

// ---- statistics

/** How an interrupt source does. Bins: bin i counts what lay below 2^(i+1) ns and not below 2^i. */
export interface SourceStatistics {
  steps: number;
  firings: number;
  overruns: number;
  late: number;
  faults: number;
  lost?: number;
  stopped: boolean;
  rights_missing: string[];
  jitter_last_ns: number;
  jitter_max_ns: number;
  jitter_bins: number[];
  jitter_median_ns: number;
  duration_last_ns: number;
  duration_max_ns: number;
  duration_bins: number[];
  duration_median_ns: number;
  period_ns?: number | null;
  priority?: number;
  kind?: "timer" | "trigger" | "software";
  processor?: string;
  core?: number | null;
  rights_asked?: string[];
}

export interface Statistics {
  now_s: number;
  sources: Record<string, SourceStatistics>;
  instances: { id: number; name: string; verb: string; state: InstanceState; list: string; owner: string | null }[];
  devices: Record<string, DeviceState>;
  physical_devices: Record<string, { lost: string | boolean | null; slew_limited: number }>;
  emergency: string | null;
  /** True: all actions; a list: the actions on these logical devices. */
  paused: boolean | string[];
  mode: Mode;
  supervisor_rights_missing: string[];
}

export type InstanceState = "created" | "queued" | "running" | "suspended" | "ended" | "deleted";
export type DeviceState = "disabled" | "enabling" | "standstill" | "moving" | "stopping" | "fault";

// ---- what is installed

export type PortDirection = "input" | "output" | "parameter" | "condition" | "device";

export interface InstalledPort {
  name: string;
  direction: PortDirection;
  type_text: string;
  unit: string;
  mode: string | null;
  doc: string;
  /** The SVV, private cell, channel or constant that it is bound to: what `read`, `svv_about` and the stream call it. */
  cell: string | null;
  /** Of an array port that is bound to one cell for each element. */
  cells?: string[];
  writes?: boolean;
  required?: boolean;
  /** Of a parameter, and of an input that nothing is bound to. */
  value?: Value;
}

export interface InstalledBlock {
  /** A block of a nested graph: `outer.inner.block`. */
  label: string;
  block: string;
  doc: string;
  source: string;
  /** How many elements its sized ports have. */
  size?: number | null;
  /** Where it was written. */
  file?: string | null;
  every_ns: number | null;
  activation: InstalledActivation;
  ports: InstalledPort[];
}

export interface InstalledActivation {
  /** Whether it is active now. */
  on: boolean;
  due: "interval" | "driven" | "queued";
  /** The blocks that drive it. */
  by: string[];
  rates: Record<string, Value>;
  budget_ns: number | null;
  tunable: boolean;
}

export type CellKind = "svv" | "private" | "channel" | "constant";

export interface InstalledCell {
  name: string;
  kind: CellKind;
  type_text: string;
  unit: string;
  writers: [string, string][];
  readers: [string, string][];
  /** Of a constant. */
  value?: Value;
}

export interface InstalledCondition {
  name: string;
  of: string[];
  /** It is one of every verb: `halted`, `time_limit`. */
  system: boolean;
  /** Output values that it returns. */
  returns: string[];
  raises: boolean;
  during: string[];
  priority: number;
  alarm: string | null;
}

export interface InstalledInstance {
  id: number;
  name: string;
  verb: string;
  state: InstanceState;
  list: string;
  owner: string | null;
  /** Where it is in its list: after how many waits. */
  stage: number;
  starts: number;
  device: string | null;
  /** The logical devices that it acts on. */
  devices: string[];
  blocks: InstalledBlock[];
  cells: InstalledCell[];
  lists: { name: string; commands: string[] }[];
  conditions: InstalledCondition[];
  transitions: { from: string; condition: string; to: string }[];
  initial: string;
  ending: string | null;
}

export interface Installed {
  instances: InstalledInstance[];
}

// ---- verbs and their forms

export interface VerbSummary {
  name: string;
  doc: string;
  class: string;
  supports: string[];
  simple: boolean;
  lists: string[];
  parts: Value;
}

export interface FormArgument {
  name: string;
  kind: "device" | "svv" | "channel" | "group";
  /** Of a device or a group its type. */
  of: string | null;
  /** Of an SVV or channel. */
  type_text: string;
  unit: string;
  doc: string;
  /** Of a part of a physical device: the channels of it that are used. */
  members: string[];
}

export interface FormInput {
  name: string;
  type_text: string;
  unit: string;
  doc: string;
  default: Value;
  /** A number, or a parameter of an object: `arm.max_speed`, `-arm.max_speed`. */
  minimum: Value;
  maximum: Value;
  /** The SVV of an object that the range is counted from. */
  counted_from: string | null;
  required: boolean;
  tunable: boolean;
}

export interface VerbForm {
  name: string;
  doc: string;
  /** It may be started in manual mode. */
  manual: boolean;
  arguments: FormArgument[];
  inputs: FormInput[];
  defined: unknown;
}

// ---- devices and configuration

export interface Channel {
  name: string;
  write: boolean;
  type_text: string;
  unit: string;
}

export interface Configuration {
  processors: Record<string, { core: number | null; supervisor: boolean }>;
  sources: Record<string, { processor: string; kind: Value; priority: number; [more: string]: unknown }>;
  physical_devices: Record<string, PhysicalDevice>;
  logical_devices: Record<string, string>;
  device_types: Record<string, DeviceType>;
}

export interface PhysicalDevice {
  source: string;
  channels: Channel[];
  /** What the driver tells of its parts: the joints of an arm. */
  parts?: { name: string; [more: string]: unknown }[];
  [more: string]: unknown;
}

export interface DeviceType {
  name: string;
  doc: string;
  verb: string | null;
  svvs: Record<string, DeviceSvv>;
  parameters: Record<string, { default: Value; unit: string; tunable: boolean }>;
}

export interface DeviceSvv {
  type_text: string;
  unit: string;
  history: number;
  /** Least and greatest value that may be written. */
  within: [number, number] | null;
  /** The devices of the type share this SVV of the system. */
  shared: string | null;
}

export interface Geometry {
  bodies: GeometryBody[];
  /** Three numbers a vertex, three vertices a face. */
  meshes: { vertices: number[]; faces: number[] }[];
}

export interface GeometryBody {
  name: string;
  parent: string | null;
  position: [number, number, number];
  /** w x y z */
  quaternion: [number, number, number, number];
  joints: GeometryJoint[];
  geoms: GeometryGeom[];
}

export interface GeometryJoint {
  name: string;
  kind: "hinge" | "slide" | "free" | "ball";
  axis: [number, number, number];
  position: [number, number, number];
  /** The position at which the body stands as the model has drawn it, rad or m. */
  reference: number | null;
  /** The name by which its position is read; null: nobody tells it. */
  svv: string | null;
}

export interface GeometryGeom {
  kind: string;
  size: number[];
  position: [number, number, number];
  quaternion: [number, number, number, number];
  rgba: [number, number, number, number];
  mesh: number | null;
}

export interface SvvAbout {
  name: string;
  /** Of an SVV: which one it is of those that have had its name. */
  id?: number;
  kind: CellKind;
  type_text: string;
  unit: string;
  history: number;
  device: string | null;
  writers: string[];
  readers: string[];
  within: [number, number] | null;
  source: string | null;
}

export interface Names {
  processors: string[];
  supervisor: string | null;
  sources: string[];
  devices: string[];
  svvs: string[];
  logical_devices: string[];
  verbs: string[];
  device_types: string[];
  modules: string[];
  blocks: string[];
  instances: string[];
}

// ---- log, ends, alarms

export interface LogEntry {
  sequence: number;
  time_s: number;
  kind: string;
  about: string;
  text: string;
  /** Of a command: who gave it. */
  who?: string;
}

/** How one start of a verb instance ended. */
export interface Report {
  instance: string;
  verb: string;
  start: number;
  condition: string;
  normal: boolean;
  command_list: string;
  block?: string | null;
  time_s: number;
  started_s: number;
  value?: Value;
  message: string;
  outputs: Record<string, Value>;
  others: { condition: string; [more: string]: unknown }[];
}

export interface End {
  number: number;
  instance: number;
  report: Report;
}

export interface Alarm {
  number: number;
  code: string;
  source: string;
  text: string;
  remedy: string;
  severity: string;
  active: boolean;
  acknowledged: boolean;
  count: number;
  time_ns: number;
}

export interface Alarms {
  current: Alarm[];
  history: Alarm[];
  texts: Record<string, unknown>;
  dropped?: number;
}

export interface Reading {
  value: Value;
  number: number;
  time_ns: number;
}
