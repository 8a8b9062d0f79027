// SPDX-License-Identifier: Apache-2.0
// What the control interface takes and answers. Made by `npm run shapes` of crates/control/schemas/control-v1.json: not edited by hand.

/** An alarm. */
export interface Alarm {
  /** Number of the alarm, unique within the system. */
  number: number;
  code: string;
  /** Verb, device or channel that raised the alarm. */
  source: string;
  /** Block that reported the alarm, if any. */
  block: string | null;
  text: string;
  remedy: string;
  severity: Severity;
  active: boolean;
  acknowledged: boolean;
  /** Number of occurrences. */
  count: number;
  /**
   * Time of the last occurrence, on the system's clock and on the wall clock (ns since the Unix epoch; if the system's clock is
   * virtual, its time is used for both).
   */
  time_ns: number;
  wall_ns: number;
  returned_ns: number | null;
  acknowledged_ns: number | null;
  /** True if the alarm can be shelved. Emergency stops, losses, critical alarms, and alarms from an earlier run stay in the list. */
  shelvable: boolean;
  /** Shelvings of the alarm, most recent last. */
  shelvings: Shelving[];
}

/** An alarm. */
export interface AlarmRequest {
  /** Number of the alarm, unique within the system. */
  number: number;
  code: string;
  /** Verb, device or channel that raised the alarm. */
  source: string;
  /** Block that reported the alarm, if any. */
  block?: string | null;
  text: string;
  remedy: string;
  severity: Severity;
  active: boolean;
  acknowledged: boolean;
  /** Number of occurrences. */
  count: number;
  /**
   * Time of the last occurrence, on the system's clock and on the wall clock (ns since the Unix epoch; if the system's clock is
   * virtual, its time is used for both).
   */
  time_ns: number;
  wall_ns: number;
  returned_ns?: number | null;
  acknowledged_ns?: number | null;
  /** True if the alarm can be shelved. Emergency stops, losses, critical alarms, and alarms from an earlier run stay in the list. */
  shelvable?: boolean;
  /** Shelvings of the alarm, most recent last. */
  shelvings?: ShelvingRequest[];
}

/** Text of an alarm code. */
export interface AlarmText {
  text: string;
  remedy: string;
  severity: Severity;
}

/** Text of an alarm code. */
export interface AlarmTextRequest {
  text: string;
  remedy?: string;
  severity?: Severity;
}

/** Alarms of a system, as returned by a call. */
export interface Alarms {
  /** Alarms that are active or not acknowledged, newest last. */
  current: Alarm[];
  /** Alarms that an operator has removed from the list of current alarms for a limited time. */
  shelved: Alarm[];
  /** Past alarms, oldest first. */
  history: Alarm[];
  /** Text of each code. */
  texts: { [name: string]: AlarmText };
  /** Number of current alarms that were dropped because the list was full. */
  dropped: number;
}

/** A verb applied to arguments: the definition of a verb instance. */
export interface Application {
  /** Name of a verb defined in the system. */
  verb: string;
  /** Name of the instance; if absent, `verb#n`. */
  name: string | null;
  arguments: { [name: string]: Argument };
  /** Pattern for flat block labels (`planner`, `pid.*`, `*`) → source (`rtp0.fast`); the first match wins. */
  placement: { [name: string]: string };
  /** Intervals changed by the application: label → ns. */
  every: { [name: string]: number };
  /** Values passed to a start, if they are to be checked as well. */
  values?: { [name: string]: Value };
  /** Logical device whose own verb this instance runs, if any. */
  owner: string | null;
  place: SourceLocation | null;
}

/** A verb applied to arguments: the definition of a verb instance. */
export interface ApplicationRequest {
  /** Name of a verb defined in the system. */
  verb: string;
  /** Name of the instance; if absent, `verb#n`. */
  name?: string | null;
  arguments?: { [name: string]: Argument };
  /** Pattern for flat block labels (`planner`, `pid.*`, `*`) → source (`rtp0.fast`); the first match wins. */
  placement?: { [name: string]: string };
  /** Intervals changed by the application: label → ns. */
  every?: { [name: string]: number };
  /** Values passed to a start, if they are to be checked as well. */
  values?: { [name: string]: Value };
  /** Logical device whose own verb this instance runs, if any. */
  owner?: string | null;
  place?: SourceLocation | null;
}

/** Handling of a start that needs an item of a logical device held by another verb. */
export type Arbitration = "refuse" | "queue" | "abort";

/** Argument of an instantiation parameter or object. */
export type Argument = {
  svv: string;
} | {
  svvs: string[];
} | {
  channel: {
    device: string;
    channel: string;
  };
} | {
  part: {
    device: string;
    part: string;
  };
} | {
  device: string;
} | {
  devices: string[];
};

/** Kind of argument of a verb. */
export type ArgumentKind = "device" | "group" | "svv" | "channel";

/** An arm: joints that together move one tool. */
export interface ArmDescription {
  name: string;
  /** Logical devices of the arm's joints, in the order of the chain. */
  joints: string[];
  /** Geometry that connects the joints; null if it is unknown. */
  chain: ChainDescription | null;
  /** Human-readable reason why the geometry is unknown; empty if it is known. */
  missing: string;
}

/** An arm: joints that together move one tool. */
export interface ArmDescriptionRequest {
  name: string;
  /** Logical devices of the arm's joints, in the order of the chain. */
  joints: string[];
  /** Geometry that connects the joints; null if it is unknown. */
  chain?: ChainDescription | null;
  /** Human-readable reason why the geometry is unknown; empty if it is known. */
  missing?: string;
}

/** Body of `POST /v1/command/request`. */
export interface AskForCommand {
  /** Purpose, shown to the holder. */
  reason?: string;
  /** Time for which the request waits for an answer, ms, 1,000 to 600,000. */
  wait_ms?: number;
}

/** A session that requests command. */
export interface AskingSession {
  /** Number of the request, unique within the system. */
  number: number;
  /** Session that made the request. */
  name: string;
  /** Caller of that session. */
  who: string;
  person: string | null;
  /** Human-readable purpose. */
  reason: string;
  /** Remaining waiting time, ms. */
  left_ms: number;
}

/** A block of a verb instance. */
export interface BlockAbout {
  /** Label of the block; in a nested graph, `outer.inner.block`. */
  label: string;
  /** Function block, as `module.block`. */
  block: string;
  /** Interrupt source that runs the block, `rtp.source`. */
  source: string;
}

/** A block that restarts. */
export interface BlockAnew {
  /** Label of the block. */
  block: string;
  /** Reason for the restart. */
  why: string;
}

/** Source of a block: a subroutine or a graph. JSON: `{"subroutine": "library.pid"}` or `{"graph": {…}}`. */
export type BlockSource = {
  subroutine: string;
} | {
  graph: Graph;
};

/** Source of a block: a subroutine or a graph. JSON: `{"subroutine": "library.pid"}` or `{"graph": {…}}`. */
export type BlockSourceRequest = {
  subroutine: string;
} | {
  graph: GraphRequest;
};

/** Durations of a block's invocations, as measured by a probe. */
export interface BlockTimes {
  /** Verb instance. */
  instance: string;
  /** Label of the block; in a nested graph, `outer.inner.block`. */
  label: string;
  /** Function block, as `module.block`. */
  block: string;
  /** Number of invocations measured. */
  samples: number;
  /** Duration of the most recently measured invocation, ns. */
  last_ns: number;
  /** Mean duration, ns. */
  mean_ns: number;
  /** Maximum duration, ns. */
  max_ns: number;
  /** Number of the most recently measured invocation. */
  number: number;
}

/** One use of a block in a graph or verb. */
export interface BlockUse {
  block: WrittenBlockSource;
  /** Constants for parameters, presets, sizes and inputs of this block (`code.biquad(b0=0.1)`). */
  constants: { [name: string]: Value };
  place: SourceLocation | null;
}

/** One use of a block in a graph or verb. */
export interface BlockUseRequest {
  block: WrittenBlockSourceRequest;
  /** Constants for parameters, presets, sizes and inputs of this block (`code.biquad(b0=0.1)`). */
  constants?: { [name: string]: Value };
  place?: SourceLocation | null;
}

/** Bound of the range of an input parameter. JSON: a number, `"arm.max_speed"` or `"-arm.max_speed"`. */
export type Bound = number | string;

/** A button that starts a verb, and halts it while it runs. */
export interface Button {
  label: string;
  /** Verb to apply: an instance is created and started with these values. If it has no name, it is called `WORKSPACE.LABEL`. */
  start?: Application | null;
  /** Instance to start instead, created by a program. */
  instance?: string | null;
  /** Start values of that instance: input parameter → value. */
  values?: { [name: string]: Value };
}

/** A button that starts a verb, and halts it while it runs. */
export interface ButtonRequest {
  label: string;
  /** Verb to apply: an instance is created and started with these values. If it has no name, it is called `WORKSPACE.LABEL`. */
  start?: ApplicationRequest | null;
  /** Instance to start instead, created by a program. */
  instance?: string | null;
  /** Start values of that instance: input parameter → value. */
  values?: { [name: string]: Value };
}

/** Kind of a data object. */
export type CellKind = "svv" | "private" | "constant" | "channel";

/** Geometry of an arm, as the value of the parameter `chain` of the kinematics blocks. Poses are x y z (m), then the quaternion w x y z. */
export interface ChainDescription {
  /** Number of joints. */
  joints: number;
  /** Kind of each of 16 joints: 0 does not move the tool, 1 revolute, 2 prismatic. */
  kind: number[];
  /** Pose of the arm's base in the frame in which poses are specified. */
  base: number[];
  /** Pose of the flange in the frame of the base with all joints at 0. */
  home: number[];
  /** Pose of the tool in the frame of the flange. */
  tool: number[];
  /** Unit vector along the axis of each of 16 joints, in the frame of the base, with all joints at 0. */
  axis: number[][];
  /** Point on each of these axes, m. */
  anchor: number[][];
}

export interface Channel {
  /** Name: `part.channel` or a plain name. */
  name: string;
  /** True if the channel is written, false if it is read. */
  write: boolean;
  type_text: string;
  unit: string;
}

/** Class of a refusal: the name of the Python exception class. */
export type Class = "TypeMismatch" | "UnitMismatch" | "NotEnabled" | "DeviceFailed" | "EmergencyStopped" | "CompositionConflict" | "DefinitionError" | "UnknownName" | "CoverError" | "SecondWriter" | "SchedulingError" | "SynchronousCycle" | "PlacementError" | "ValueRefused" | "OutOfRange" | "NotHomed" | "CallError" | "InvalidState" | "ModuleError" | "InUse" | "NotAllowed" | "NotCommanding" | "SessionLost" | "LimitExceeded" | "AuditFailed";

/** Clock of a system. */
export type ClockName = "monotonic" | "virtual";

/** A function block command. */
export type Command = {
  command: "install";
  blocks: NameList;
} | {
  command: "execute";
  block: string;
} | {
  command: "activate";
  block: string;
  every_ns: number | null;
  /** True if the interval may be changed while the verb is running. */
  tunable: boolean;
  budget_ns: number | null;
} | {
  command: "deactivate";
  block: string;
} | {
  command: "wait";
  conditions: NameList;
  time_ns: number | null;
} | {
  command: "ready";
};

export interface CommandList {
  commands: WrittenCommand[];
  place: SourceLocation | null;
}

export interface CommandListRequest {
  commands: WrittenCommandRequest[];
  place?: SourceLocation | null;
}

/** A function block command. */
export type CommandRequest = {
  command: "install";
  blocks: NameList;
} | {
  command: "execute";
  block: string;
} | {
  command: "activate";
  block: string;
  every_ns?: number | null;
  /** True if the interval may be changed while the verb is running. */
  tunable?: boolean;
  budget_ns?: number | null;
} | {
  command: "deactivate";
  block: string;
} | {
  command: "wait";
  conditions?: NameList;
  time_ns?: number | null;
} | {
  command: "ready";
};

/** A command list, or only its commands. */
export type Commands = WrittenCommand[];

/** A command list, or only its commands. */
export type CommandsRequest = WrittenCommandRequest[];

/** Definition of a composed verb. */
export interface Composition {
  name: string;
  doc?: string;
  /** Label → verb, in the order of the parameters of a call. */
  parts: { [name: string]: VerbRequest };
  transitions?: Step[];
  /** Initial part or list; if absent, the first part. */
  initial?: string | null;
  /** `part.name` → name in the composed verb, for a parameter, object, output or condition. */
  rename?: { [name: string]: string };
  /** `part.input` → fixed value of the input. */
  preset?: { [name: string]: Value };
  /** Labels of shared blocks: all parts use the same instance. */
  share?: string[];
  /** True if the initial lists of all parts are merged into one. */
  together?: boolean;
  /** Ending rule of parts that run together. */
  until?: TogetherUntil;
  place?: SourceLocation | null;
}

/** Configuration: processors, interrupt sources, physical devices, logical devices and their types. */
export interface Configuration {
  processors: { [name: string]: ProcessorAbout };
  /** Interrupt sources, `rtp.source`. */
  sources: { [name: string]: Source };
  /** Physical devices as described by their drivers. */
  physical_devices: { [name: string]: PhysicalDevice };
  /** Logical devices with their device types. */
  logical_devices: { [name: string]: string };
  device_types: { [name: string]: DeviceType };
}

/** An unreadable part of a recording. */
export type DamagedPart = {
  /** Offset of the first byte of the part in the file; `ends` is the offset after its last byte. */
  begins: number;
  ends: number;
  what: string;
  /** Bounds on the times of the lost messages, ns on the system's clock, if the file contains them. */
  from_ns: number | null;
  to_ns: number | null;
  /** Number of lost messages by channel: empty if none is lost, `None` if the file does not contain the numbers. */
  lost: { [name: string]: number } | null;
};

/** Body of `POST /v1/command/decline`. */
export interface DeclineRequest {
  /** Session that made the request. */
  name: string;
  /** Human-readable reason. */
  reason?: string;
}

export interface DeviceParameter {
  default: Value;
  unit: string;
  tunable: boolean;
  /** Range of the parameter's values. */
  within?: Within | null;
  /** True if the PS keeps the value across a warm restart; if absent, true for a tunable parameter. */
  keep?: boolean | null;
}

export interface DeviceParameterRequest {
  default: Value;
  unit?: string;
  tunable?: boolean;
  /** Range of the parameter's values. */
  within?: Within | null;
  /** True if the PS keeps the value across a warm restart; if absent, true for a tunable parameter. */
  keep?: boolean | null;
}

/** A joint of a machine. */
export interface DevicePart {
  name: string;
  [more: string]: unknown;
}

/** Request to create a logical device. */
export interface DeviceRequest {
  device_type: string;
  /** Parameters whose values differ from those of the type. */
  parameters?: { [name: string]: Value };
  /**
   * Verb that operates the device, if it differs from the type's because the drive is commanded in a different way. Its parameters are
   * matched to the members by name.
   */
  verb?: string | null;
  /** Additional arguments of the verb (`drive`). */
  arguments?: { [name: string]: Argument };
  /** `rtp.name` of the source on which the verb runs. */
  source?: string | null;
  /** Intervals of the verb's blocks that differ from those in the command list, ns. */
  every?: { [name: string]: number };
  /** Unit parts that this device replaces, in order. */
  units?: [string, string][];
  /** Arbitration for a second verb that commands the device, if it differs from the type's. */
  arbitration?: Arbitration | null;
  place?: SourceLocation | null;
}

/** State of a logical device. */
export type DeviceState = "disabled" | "enabling" | "standstill" | "moving" | "stopping" | "fault";

/** A logical device type: an optional verb, SVVs, and parameters. */
export interface DeviceType {
  name: string;
  doc: string;
  /** Name of the verb that operates the device; its parameters are matched to the members by name. */
  verb: string | null;
  svvs: { [name: string]: SvvSpecification };
  parameters: { [name: string]: DeviceParameter };
  arbitration: Arbitration;
  place: SourceLocation | null;
}

/** A logical device type: an optional verb, SVVs, and parameters. */
export interface DeviceTypeRequest {
  name: string;
  doc?: string;
  /** Name of the verb that operates the device; its parameters are matched to the members by name. */
  verb?: string | null;
  svvs?: { [name: string]: SvvSpecificationRequest };
  parameters?: { [name: string]: DeviceParameterRequest };
  arbitration?: Arbitration;
  place?: SourceLocation | null;
}

/** Drawing to check: a graph or a verb. */
export interface Drawing {
  graph?: GraphRequest | null;
  verb?: VerbRequest | null;
}

/** A counter of a driver. */
export interface DriverCounter {
  name: string;
  /** Unit, or empty for a plain number. */
  unit: string;
  doc: string;
}

/** An option of a driver, or an argument of a service. */
export interface DriverOption {
  name: string;
  /** "text", "number", "whole", "bool", "list" or "table". */
  kind: string;
  /** Unit, or empty if none. */
  unit: string;
  /**
   * Range of a number, or of each number in a list, such as `(0, 10]`: a round bracket excludes the end. Omitted if every number is
   * valid.
   */
  range?: string | null;
  /** Description of the default; null if the option is required. */
  default: string | null;
  doc: string;
}

/** The safe state of a device. */
export interface DriverSafeState {
  /** Description of the state. */
  doc: string;
  /** Agents that establish the state: "driver", "guard", "device", "end of process". */
  by: string[];
  /** Maximum time from the request until the state is reached, ns. */
  within_ns: number;
}

/** A service of a driver: a command off the cycle. */
export interface DriverService {
  name: string;
  doc: string;
  arguments: DriverOption[];
  /** Kind of the service's answer; null if there is none. */
  answer: string | null;
  /** True if the service moves the device and is therefore refused while an emergency stop is latched. */
  moves: boolean;
}

/**
 * Reason for which an active block becomes due: its interval or trigger, the blocks that drive it, or values from other sources and
 * instances.
 */
export type DueBy = "interval" | "driven" | "queued";

/** End of one start. */
export interface End {
  /** Number of the end, counted from 0 over the lifetime of the system. */
  number: number;
  instance: number;
  report: Report;
}

/** A forced signal. */
export interface ForcedSignal {
  /** Number of the force, unique within the system. */
  number: number;
  /** Channel, `device.channel`. */
  channel: string;
  /** True for an output, false for an input. */
  output: boolean;
  /** Value that replaces the reading or the command, in the unit of the channel. */
  value: Value;
  /** Person or session that forces the signal. */
  who: string;
  /** Time on the system's clock at which the signal was forced, s. */
  since_s: number;
}

/** Argument needed to create an instance. */
export interface FormArgument {
  name: string;
  kind: ArgumentKind;
  /** Type of a device or a group. */
  of: string | null;
  /** Type of an SVV or channel; empty if the argument may have several types. */
  type_text: string;
  unit: string;
  doc: string;
  /** Channels that are used, if the argument is a part. */
  members: string[];
}

/** Value passed to a start. */
export interface FormInput {
  name: string;
  type_text: string;
  unit: string;
  doc: string;
  default: Value | null;
  /** Number, or parameter of an object, such as `arm.max_speed`, optionally preceded by a minus sign. */
  minimum: Bound | null;
  maximum: Bound | null;
  /** SVV of an object to which the range is relative. */
  counted_from: string | null;
  /** True if the input has no default. */
  required: boolean;
  /** True if the value may be changed while the verb is running. */
  tunable: boolean;
}

/** Groups of fused blocks, and blocks that are not fused. */
export interface FusedBlocks {
  /** True if tables use the available entry points. This also applies to future instances. */
  on: boolean;
  /** Number of groups that have not been compiled yet, with which `fuse` continues. */
  waiting: number;
  /** Groups of blocks, identified by their sources. */
  groups: FusedGroup[];
  /** Blocks that cannot be fused. */
  single: SingleBlock[];
}

/** Consecutive blocks that are always due together, some of which read values stored by others. */
export interface FusedGroup {
  /** Interrupt source on which the blocks run. */
  source: string;
  /** Labels of the blocks, as `instance.label`, in execution order. */
  blocks: string[];
  /** True if the group runs through one entry point. */
  fused: boolean;
  /** Reason why the group has no entry point. */
  why: string | null;
}

/** Bodies of a machine for drawing. Lengths are in metres, quaternions are w x y z, and poses are relative to the parent. */
export interface Geometry {
  /** Bodies in the order of the model; the first is the world. */
  bodies: GeometryBody[];
  meshes: GeometryMesh[];
  /**
   * Name under which contacts are read, six numbers each: position, m, and force, N, in the world frame; null if contacts are not
   * reported.
   */
  contacts: string | null;
}

/** A body: its pose relative to its parent, its joint, and its shapes. */
export interface GeometryBody {
  name: string;
  /** Parent; null for the world. */
  parent: string | null;
  position: [number, number, number];
  /** w x y z. */
  quaternion: [number, number, number, number];
  /** First joint of the body. */
  joint: GeometryJoint | null;
  joints: GeometryJoint[];
  geoms: GeometryGeom[];
}

/** A shape of a body. */
export interface GeometryGeom {
  /** `plane`, `hfield`, `sphere`, `capsule`, `ellipsoid`, `cylinder`, `box`, `mesh`, `sdf`. */
  kind: string;
  /** Size in MuJoCo's convention: half lengths, radii. */
  size: [number, number, number];
  position: [number, number, number];
  /** w x y z. */
  quaternion: [number, number, number, number];
  /** Red, green, blue, opacity, 0 to 1. */
  rgba: [number, number, number, number];
  /** Index into the meshes; null if the shape is drawn according to its kind. */
  mesh: number | null;
}

/** A joint of a body. */
export interface GeometryJoint {
  name: string;
  kind: JointKind;
  axis: [number, number, number];
  position: [number, number, number];
  /**
   * Position of a revolute or prismatic joint in the drawn model, rad or m. A viewer rotates or moves the body by position -
   * reference.
   */
  reference: number | null;
  /** Name under which the joint's position is read; null if no channel reports it. */
  svv: string | null;
}

/** Triangle mesh. */
export interface GeometryMesh {
  /** Coordinates, three per vertex. */
  vertices: number[];
  /** Vertex indices, three per face. */
  faces: number[];
}

/** A data flow graph (f, I, O, L, ρ): `inputs`, `outputs` and `cells` are ρ. */
export interface Graph {
  name: string;
  doc: string;
  blocks: { [name: string]: WrittenBlockUse };
  inputs: { [name: string]: NameList };
  outputs: { [name: string]: NameList };
  cells: { [name: string]: NameList };
  /** Relaxed modes: port → mode. */
  modes: { [name: string]: PortMode };
  /** `divide={"estimator": 5}`: the block runs with period 5 T if the graph is activated with period T. */
  divide: { [name: string]: number };
  place: SourceLocation | null;
}

/** A data flow graph (f, I, O, L, ρ): `inputs`, `outputs` and `cells` are ρ. */
export interface GraphRequest {
  name: string;
  doc?: string;
  blocks: { [name: string]: WrittenBlockUseRequest };
  inputs?: { [name: string]: NameList };
  outputs?: { [name: string]: NameList };
  cells?: { [name: string]: NameList };
  /** Relaxed modes: port → mode. */
  modes?: { [name: string]: PortMode };
  /** `divide={"estimator": 5}`: the block runs with period 5 T if the graph is activated with period T. */
  divide?: { [name: string]: number };
  place?: SourceLocation | null;
}

/** Body of `POST /v1/command/hand_over`. */
export interface HandOver {
  /** Session that receives command. */
  to: string;
}

/** Holder of command, pending requests, and the outcomes of the most recent requests. */
export interface Holder {
  /** Name of the session that has command; null if none does. */
  holder: string | null;
  /** Caller of that session: a user, a token or a certificate. */
  who: string | null;
  /** Name of that session's person, if provided. */
  person: string | null;
  /** Pending requests for command, oldest first. */
  requests: AskingSession[];
  /** Most recently completed requests, oldest first. */
  settled: SettledRequest[];
}

/**
 * Sets `set`, a Boolean input or parameter, to true; the verb stops when the condition `until` occurs. Resuming clears `set`. Applies in
 * the command lists in which the block of `until` is active.
 */
export interface Holding {
  set: string;
  until: string;
}

/** Reaction of a running verb instance when the programming system that started it dies or becomes unreachable. */
export type IfCutOff = "continue" | "halt" | "safe";

/** Process of a processor, as passed in a call. */
export type InProcess = boolean | string;

/** Initial value of an SVV of a logical device. */
export type Initial = {
  value: Value;
} | {
  copy_of: string;
};

/** An input parameter: ψ. */
export interface InputParameter {
  targets: NameList;
  default: Value | null;
  tunable: boolean;
  /** True if the default is used at every start and no call can override it (`preset=` of a composition). */
  preset: boolean;
  unit: string;
  /** Minimum and maximum, checked before a start. */
  within: [Bound, Bound] | null;
  /** SVV of an object relative to which the value is given (`arm.commanded`, for a relative goal); the range applies to their sum. */
  counted_from: string | null;
  /** Attribute of an object, such as `arm.chain`, that the PS reads if a call omits the input. */
  member?: string | null;
  /** Name of the PS function that converts user input to the value. */
  form?: string | null;
  place: SourceLocation | null;
}

/** An input parameter: ψ. */
export interface InputParameterRequest {
  targets: NameList;
  default?: Value | null;
  tunable?: boolean;
  /** True if the default is used at every start and no call can override it (`preset=` of a composition). */
  preset?: boolean;
  unit?: string;
  /** Minimum and maximum, checked before a start. */
  within?: [Bound, Bound] | null;
  /** SVV of an object relative to which the value is given (`arm.commanded`, for a relative goal); the range applies to their sum. */
  counted_from?: string | null;
  /** Attribute of an object, such as `arm.chain`, that the PS reads if a call omits the input. */
  member?: string | null;
  /** Name of the PS function that converts user input to the value. */
  form?: string | null;
  place?: SourceLocation | null;
}

/** Activation of a block, and the reason for which it becomes due. */
export interface InstalledActivation {
  /** True if the activation is active. */
  on: boolean;
  due: DueBy;
  /** Labels of the blocks that drive the activation. */
  by: string[];
  /** Rate in each command list in which the activation is active. */
  rates: { [name: string]: Rate };
  /** Time budget of one invocation, ns. */
  budget_ns: number | null;
  /** True if the interval may be changed at run time. */
  tunable: boolean;
}

/** A function block instance. */
export interface InstalledBlock {
  /** Label of the block; in a nested graph, `outer.inner.block`. */
  label: string;
  /** Function block, as `module.block`. */
  block: string;
  doc: string;
  /** Interrupt source that runs the block, `rtp.source`. */
  source: string;
  /** Number of elements of the block's sized ports. */
  size: number | null;
  /** Source file of the block; empty if unknown. */
  file: string;
  /** Current interval if the block is active, otherwise that of the first list that activates it, ns; null if no timer determines it. */
  every_ns: number | null;
  ports: InstalledPort[];
  activation: InstalledActivation;
}

/** A data object that blocks read and write. */
export interface InstalledCell {
  name: string;
  kind: CellKind;
  type_text: string;
  unit: string;
  /** Labels and ports of the writers. */
  writers: [string, string][];
  /** Labels and ports of the readers. */
  readers: [string, string][];
  /** Value of a constant. */
  value?: Value | null;
}

/** A termination condition. */
export interface InstalledCondition {
  name: string;
  /** Block conditions that make up this condition, as `label.condition`. */
  of: string[];
  /** True if every verb has the condition: `halted`, `time_limit`. */
  system: boolean;
  /** Output values that the condition returns. */
  returns: string[];
  /** True if the condition ends the verb with an exception. */
  raises: boolean;
  /** Command lists in which the condition holds; if empty, all. */
  during: string[];
  priority: number;
  /** Code of the alarm that the condition raises. */
  alarm: string | null;
}

/** A verb instance with its blocks, cells, command lists, conditions and transitions. */
export interface InstalledInstance {
  id: number;
  name: string;
  verb: string;
  state: InstanceState;
  /** Command list that is running or was the last to run. */
  list: string;
  /** Index of the current wait in the list. */
  stage: number;
  /** Logical device whose own verb this instance runs, if any. */
  owner: string | null;
  /** Number of starts. */
  starts: number;
  /** Owner of the instance, or else the first of the logical devices on which it acts. */
  device: string | null;
  /** Logical devices on which the instance acts. */
  devices: string[];
  /**
   * Current values of the input parameters: those of the latest start, updated by later changes, or the defaults before the first
   * start. Null if there is no value yet.
   */
  inputs: { [name: string]: Value | null };
  blocks: InstalledBlock[];
  cells: InstalledCell[];
  lists: InstalledList[];
  conditions: InstalledCondition[];
  transitions: InstalledTransition[];
  /** List with which a start begins. */
  initial: string;
  /** List that runs at the end. */
  ending: string | null;
}

/** Installed verb instances. */
export interface InstalledInstances {
  instances: InstalledInstance[];
}

/** A command list. */
export interface InstalledList {
  name: string;
  /** Commands in the syntax of a program, for display. */
  commands: string[];
}

/** A port, parameter, condition or device item of a block, and its binding. */
export interface InstalledPort {
  name: string;
  direction: PortDirection;
  /** True if the block writes the port. */
  writes: boolean;
  type_text: string;
  unit: string;
  /** Effective mode: `synchronous`, `ratio 5`, `asynchronous`. */
  mode: string;
  doc: string;
  /** SVV, private cell, channel or constant to which the port is bound, by the name used in `read`, `svv_about` and the stream. */
  cell: string | null;
  /** True if the port is an input without a default. */
  required: boolean;
  /** Cells of an array port that is bound to one cell per element. */
  cells?: string[] | null;
  /** Value of a parameter or an unbound input, as set at creation. */
  value?: PortValue | null;
}

/** A transition: on this condition, the list `to` follows the list `from`. */
export interface InstalledTransition {
  from: string;
  condition: string;
  to: string;
}

/** A verb instance. */
export interface InstanceAbout {
  name: string;
  verb: string;
  state: InstanceState;
  blocks: BlockAbout[];
  /** Names of the command lists. */
  lists: string[];
  /** Command list that is running or was the last to run. */
  list: string;
  /** Names of the termination conditions, including those that every verb has. */
  conditions: string[];
  /**
   * Current values of the input parameters: those of the latest start, updated by later changes, or the defaults before the first
   * start. Null if there is no value yet.
   */
  inputs: { [name: string]: Value | null };
  /** Names of the output values. */
  outputs: string[];
  /** Logical device whose own verb this instance runs, if any. */
  owner: string | null;
  /** Number of starts. */
  starts: number;
  /** Running time since the start, excluding suspensions, s. */
  running_s: number;
  /** Remarks, for example about arguments that were added implicitly at creation. */
  remarks: string[];
}

/** State of a verb instance: created → (queued →) running ⇄ suspended → ended (→ running again by `start`) → deleted. */
export type InstanceState = "created" | "running" | "suspended" | "ended" | "queued" | "deleted";

/** A one-line summary of a verb instance. */
export interface InstanceStatistics {
  id: number;
  name: string;
  verb: string;
  state: InstanceState;
  /** Command list that is running or was the last to run. */
  list: string;
  /** Logical device whose own verb this instance runs, if any. */
  owner: string | null;
  /** Running time since the start, excluding suspensions, s. */
  running_s: number;
}

/** Interface of a block. */
export interface Interface {
  /** Name of the block, as `module.block`. */
  name: string;
  doc: string;
  items: Item[];
  /** Named struct types used by the items: name → declaration (`struct { double x; double[4] q; }`). */
  types: { [name: string]: string };
  file: string;
  line: number;
}

/** Item of an interface; its index in [`Interface::items`] equals its index in the descriptor. */
export interface Item {
  name: string;
  kind: ItemKind;
  mode: PortMode;
  /** C type as declared; empty if the item is a condition without a value. */
  type_text: string;
  unit: string;
  /**
   * Items whose units determine the unit of this item: declared as `=u`, the unit of u, or `=k.u`, the product of both units. `unit`
   * is then empty.
   */
  unit_of?: string[];
  /**
   * Allowed numbers (for an array, of each element), declared after the unit as in `rad/s (0, 10]`. If absent, any finite number is
   * allowed.
   */
  range?: Range | null;
  doc: string;
  /** True if the input may be left unbound. */
  has_default: boolean;
  nonfinite: boolean;
  /** True if the number of elements is the block's size. */
  sized: boolean;
  /**
   * Number of most recent values that a history input reads; they are ordered oldest first. 0 if the input reads only the current
   * value. `type_text` is the type of a single value.
   */
  history: number;
  /** Default of a parameter, preset or defaulted input, as bytes of its type (from the descriptor's image); unused for a size. */
  default: number[];
  /** Minimum and maximum n of a size item. */
  least: number;
  most: number;
}

export type ItemKind = "input" | "output" | "device_read" | "device_write" | "condition" | "parameter" | "state" | "size";

/** Type of joint. */
export type JointKind = "free" | "ball" | "slide" | "hinge";

/** An end report that is kept for its session. */
export interface KeptReport {
  /** Number of the end, unique within the system. */
  number: number;
  /** Verb instance. */
  instance: number;
  report: Report;
}

/** End reports that are kept for a session. */
export interface KeptReports {
  /** Reports, oldest first. */
  reports: KeptReport[];
  /** Number of reports dropped because too many were waiting. */
  lost: number;
}

/** Kind of an interrupt source. */
export type KindOfSource = "timer" | "trigger" | "software";

/** Limits that apply to one start. */
export interface Limits {
  /** Running time after which `time_limit` occurs, ns. */
  time_limit_ns?: number | null;
  /** Number of overruns of the instance's sources after which `overrun` occurs. */
  overruns?: number | null;
  /**
   * Maximum age of a value from another source, ns; beyond it, `late` (for a ratio input) or `link_lost` (for a value that a timer
   * publishes in each firing) occurs.
   */
  age_max_ns?: number | null;
}

export interface LogEntry {
  sequence: number;
  time_s: number;
  /**
   * Kind of the entry: `start`, `admission`, `exchange`, `end`, `condition`, `transition`, `ending`, `fault`, `overrun`, `late`,
   * `device`, `processor_lost`, `emergency_stop`, `lost`, `journal`, `control`, `recorder`, `module`, `command`.
   */
  kind: string;
  /** Verb instance, device or source to which the entry refers. */
  about: string;
  text: string;
  /**
   * Caller of a command: `program` for the program of which this system is a part, or a session or caller of the control interface;
   * otherwise empty.
   */
  who: string;
}

/** Mode of operation, which determines the actions that may be started. */
export type Mode = "automatic" | "manual";

/** A code module: its blocks and struct types. */
export type ModuleAbout = {
  name: string;
  blocks: Interface[];
  /** Declarations of the struct types by name. */
  types: { [name: string]: string } | null;
  /** Remark about the module. */
  note?: string | null;
};

/** One or several names, as JSON allows. */
export type NameList = string | string[];

/** A work frame, or a tool in the frame of the flange. */
export interface NamedFrame {
  name: string;
  /** m */
  position: [number, number, number];
  /** Roll, pitch and yaw, degrees. */
  rpy_deg: [number, number, number];
}

/** Names of all existing items. */
export interface Names {
  processors: string[];
  /** Processors outside the supervisor's process, by process. */
  processes: { [name: string]: string[] };
  /** Processor on which the supervisor runs. */
  supervisor: string | null;
  /** Interrupt sources, `rtp.source`. */
  sources: string[];
  /** Physical devices. */
  devices: string[];
  svvs: string[];
  logical_devices: string[];
  verbs: string[];
  device_types: string[];
  /** Downloaded code modules. */
  modules: string[];
  /** Function blocks, `module.block`. */
  blocks: string[];
  /** Verb instances. */
  instances: string[];
}

/** An object of a verb: one logical device or, with `each`, several of the same type. */
export interface Object {
  device_type: string;
  each: boolean;
}

/** An object of a verb: one logical device or, with `each`, several of the same type. */
export interface ObjectRequest {
  device_type: string;
  each?: boolean;
}

/** Body of `POST /v1/sessions`. */
export interface OpenSession {
  /** Name chosen by the caller: letters, digits, `.`, `_` and `-`, at most 64. */
  name: string;
  /** Time without a sign of life after which the session is considered lost, ms, 1,000 to 60,000. */
  lost_after_ms?: number;
  /** True to take over a live session with that name, which must belong to the same caller. */
  take_up?: boolean;
  /** Name of the person, which is shown to others; at most 64 characters. If omitted, an existing session keeps its person. */
  person?: string | null;
}

/** Further condition that occurred in the firing that ended the verb, or while the ending condition was being handled. */
export interface Other {
  condition: string;
  block: string;
  time_s: number;
}

/** Outcome of a request for command. */
export type Outcome = "granted" | "declined" | "timed_out" | "withdrawn";

/** Content of a panel. */
export type PanelKind = "plot" | "scene" | "values" | "verb" | "alarms" | "buttons";

/** A part of a composed verb. */
export interface Part {
  /** Name of the verb from which the part was created. */
  verb: string;
  /** Command list of the composed verb with which the part begins. */
  initial: string;
}

/** A command list that the verb left because of a condition. */
export interface PassedList {
  command_list: string;
  condition: string;
  /** Block that reported the condition, if any. */
  block: string | null;
  time_s: number;
}

/** Pauses in force: true for all actions, false for none, or the list of logical devices whose actions are paused. */
export type PausesInForce = boolean | string[];

/** A physical device as described by its driver. */
export interface PhysicalDevice {
  /** Interrupt source that reads and writes the device; absent from the answer to the call that opens it. */
  source?: string | null;
  channels: Channel[];
  /** Joints of the machine, for which logical devices can be created. */
  parts?: DevicePart[] | null;
  /** Time without a command after which the device enters its safe state, ns. */
  watchdog_ns?: number | null;
  /**
   * True if the device continues to follow its last commands when its driver's process exits or hangs, because it has no watchdog and
   * no guard can reach it.
   */
  unguarded?: boolean;
  /** Explanation of `unguarded` and the remedy; absent if the device can be made safe. */
  unguarded_why?: string | null;
  /** Execution context of the driver's exchange: "inline", "worker" or "process". */
  class?: string | null;
  /** Agents that bring the outputs to their safe state, and the time that they take to do so. */
  safe_state?: DriverSafeState | null;
  /** Acyclic services of the driver. */
  services?: DriverService[];
  /** Counters of the driver. */
  counters?: DriverCounter[];
  [more: string]: unknown;
}

/** Statistics of a physical device. */
export interface PhysicalDeviceStatistics {
  /** Cause of the loss; null if the device is not lost. */
  lost: string | null;
  /** Number of commands to which a slew rate limit was applied. */
  slew_limited: number;
  /** Counters of the driver, by name. */
  counters: { [name: string]: number };
}

/** A verb with its arguments, ready for installation. */
export interface Plan {
  verb: string;
  blocks: PlannedBlock[];
  cells: PlannedCell[];
  activations: PlannedActivation[];
  /**
   * Blocks of each source in firing order, as (`rtp.name`, blocks). The order is determined by synchronous edges, then by asynchronous
   * ones unless they form a cycle, then by declaration order.
   */
  order: [string, number[]][];
  lists: PlannedList[];
  /** Index of the initial list. */
  initial: number;
  ending: PlannedEnding;
  suspend: PlannedSuspend;
  /** Reaction of the instance when the programming system that started it is cut off, if its verb declares one. */
  if_cut_off: IfCutOff | null;
  conditions: PlannedCondition[];
  inputs: PlannedInput[];
  requirements: PlannedRequirement[];
  outputs: PlannedOutput[];
  claims: PlannedClaim[];
  /** Arbitration with another holder, for each claim, as declared by the logical device to which the claimed object belongs. */
  arbitration: Arbitration[];
  /** Logical devices that must be enabled. */
  devices: string[];
  /** True if the verb may be started in manual mode. */
  manual: boolean;
  remarks: Remark[];
}

/**
 * Blocks on one source that are always active together at the same rate. The sets are maximal, so that a chain that is activated as one
 * also runs as one.
 */
export interface PlannedActivation {
  source: string;
  due: PlannedDue;
  blocks: number[];
  budget_ns: number | null;
  /** True if the interval may be changed while it is active. */
  tunable: boolean;
  /**
   * Rates at which it is active, as (index of the command list, rate). They determine how inputs of later instances relate to its
   * outputs.
   */
  rates: [number, Rate][];
}

/** Binding of a port or device item. */
export type PlannedBinding = {
  Cell: number;
} | {
  Cells: number[];
};

/** Subroutine instance: a block of a verb with its ports, parameters and source. */
export interface PlannedBlock {
  /** Flat label: `servo.pid`. */
  label: string;
  /** Function block, as `module.block`. */
  block: string;
  /** Source of the block, as `rtp.name`. */
  source: string;
  /** Size n of a sized block. */
  size: number | null;
  /** Values of parameters, presets and sizes that differ from the block's defaults: item → bytes. */
  values: [number, number[]][];
  bindings: PlannedPort[];
  /** Blocks of this plan on the same source that drive the block's synchronous inputs. */
  drivers: number[];
  /** SVVs, written outside this plan, that drive the block's synchronous or ratio inputs: (item, SVV name). */
  external_drivers: [number, string][];
  /** Blocks of this plan on other sources that drive the block's synchronous inputs. */
  remote_drivers: number[];
  /** Activation to which the block belongs. Every block has one; the activation of a block that is only executed is never active. */
  activation: number;
  place: SourceLocation | null;
}

export type PlannedBound = {
  Number: number;
} | {
  Parameter: {
    sign: number;
    devices: string[];
    parameter: string;
  };
};

/** Data object of the instance. */
export interface PlannedCell {
  kind: PlannedCellKind;
  /** Normalised type. */
  type_text: string;
  size: number;
  align: number;
  unit: string;
  /** Bytes with which a private or constant cell is initialised at each start. */
  initial: number[];
  /** Blocks of this plan, with their items, that write and read the cell. */
  writers: [number, number][];
  readers: [number, number][];
}

/** Kind of a cell. */
export type PlannedCellKind = {
  Svv: {
    id: SvvId;
    name: string;
  };
} | {
  Private: {
    name: string;
  };
} | {
  Constant: {
    name: string;
  };
} | {
  Channel: {
    device: string;
    channel: number;
    write: boolean;
  };
};

/** Object that a start claims. */
export type PlannedClaim = {
  Svv: {
    id: SvvId;
    name: string;
  };
} | {
  Channel: {
    device: string;
    channel: number;
  };
};

/** Command of a list, resolved. */
export type PlannedCommand = "Ready" | {
  Install: number[];
} | {
  Execute: number[];
} | {
  On: {
    activation: number;
    every: number;
  };
} | {
  Off: number;
};

/** A termination condition, resolved. The eight system conditions follow those of the verb unless the verb lists them itself. */
export interface PlannedCondition {
  name: string;
  /** Block conditions that make up this condition, as (block, item); empty for a system condition. */
  on: [number, number][];
  /** ν: indices into `outputs`. */
  returns: number[];
  /** True if the end is normal, that is, raises no exception: `completed`, or a condition that has `returns` and no `raises`. */
  normal: boolean;
  priority: number;
  /** Lists in which the condition holds; if empty, all. Conditions with the same name have no list in common. */
  during: number[];
  /** Code of the alarm that the condition raises. */
  alarm: string | null;
}

/** Reason for which an active activation becomes due. */
export type PlannedDue = "Interval" | {
  Driven: {
    by: [number, number][];
  };
} | {
  Queued: {
    by: [number, number][];
  };
};

/** Ending behaviour of the verb, resolved. */
export interface PlannedEnding {
  /** Index of the ending list. */
  list: number | null;
  /** Limit on the ending list's running time, ns. */
  limit_ns: number;
}

/** Port that is set to true, and the condition (block, item) to wait for if its block is active. */
export interface PlannedHolding {
  set: PlannedTarget;
  until: [number, number];
}

/** An input parameter: ψ, resolved. */
export interface PlannedInput {
  name: string;
  origin: PlannedOrigin;
  /** Normalised type with all struct declarations expanded. */
  type_text: string;
  unit: string;
  default: Value | null;
  tunable: boolean;
  range: PlannedRange | null;
  /** Ranges of the items in which the value is stored. */
  item_ranges: Range[];
  targets: PlannedTarget[];
}

export interface PlannedList {
  name: string;
  stages: PlannedStage[];
  /** τ(this list, condition) = list, as indices. */
  transitions: [number, number][];
}

/** A member of a logical device. */
export type PlannedMember = {
  Svv: string;
} | {
  Parameter: {
    device: string;
    parameter: string;
  };
};

/** Origin of an input parameter's value. */
export type PlannedOrigin = "Given" | "Preset" | {
  DeviceParameter: {
    devices: string[];
    parameter: string;
  };
};

/** An output value: ω, resolved. */
export interface PlannedOutput {
  name: string;
  type_text: string;
  target: PlannedTarget;
}

/** Relation of an input to its writer after modes have been relaxed. */
export interface PlannedPort {
  item: number;
  binding: PlannedBinding;
  /** Effective mode. */
  mode: PortMode;
  /** Number of values that a history input reads; otherwise 0. */
  history: number;
}

/** Range of an input parameter, resolved. */
export interface PlannedRange {
  least: PlannedBound;
  most: PlannedBound;
  /** SVVs to which the value is relative, one per device. */
  counted_from: string[];
}

/** Property that one device must have when the verb starts. */
export interface PlannedRequirement {
  device: string;
  member: PlannedMember;
  /** Member that must be true for the requirement to apply. */
  when: PlannedMember | null;
  raises: Class;
  remedy: string;
}

/** Section of a command list, up to the next wait or the end of the list. */
export interface PlannedStage {
  commands: PlannedCommand[];
  /**
   * Wait that ends the stage; `None` at the end of the list. The process then continues until a condition occurs or no instance is
   * active.
   */
  wait: PlannedWait | null;
  /** Activations that are active after the commands of this stage: (activation, every). */
  active: [number, number][];
}

/** Suspension of the instance, resolved. */
export type PlannedSuspend = "Idle" | "Hold" | "HoldLast" | "Safe" | {
  Holding: PlannedHolding[];
};

/** Storage to which a value is written or from which it is read. */
export type PlannedTarget = {
  Cell: number;
} | {
  Item: {
    block: number;
    item: number;
  };
} | {
  Report: {
    block: number;
    item: number;
  };
} | {
  Cells: number[];
};

/** End of a stage. */
export type PlannedWait = {
  Conditions: [number, number][];
} | {
  Time: number;
} | "Idle";

/** Direction of a port. */
export type PortDirection = "input" | "output" | "parameter" | "condition" | "device";

/** Relation of a port's updates to its block's invocations. */
export type PortMode = "synchronous" | "asynchronous" | {
  ratio: number;
};

/** A port of a block or, if `block` is empty, of the graph itself, as identified by a drawing editor. */
export interface PortName {
  block: string;
  port: string;
}

/** Value of an unbound port, or number of elements of a block; null if there is none. */
export type PortValue = Value | number | null;

/** Reason why two ports cannot be wired together; if only one port is passed, a list with the reason for every other port. */
export type PortVerdicts = string | null | Verdict[];

/** Result for a processor in its own process, or for several processors that share a process. */
export interface ProcessTakenOver {
  /** Name of the processor, or of the process if it can be shared. */
  name: string;
  /** Processors in the process. */
  processors: string[];
  /** True if the running blocks of the process were taken over; false if the process was started for this system. */
  is_adopted: boolean;
  /** Labels of blocks that continue from their previous state. */
  carried: string[];
  /** Blocks that restart, each with the reason. */
  anew: BlockAnew[];
  /** Labels of blocks that were running but have not been started by this system; they have ended. */
  ended: string[];
  /** Longest time for which a device was not written, ns; null if there are no devices. */
  gap_ns: number | null;
}

/** A real-time processor. */
export interface ProcessorAbout {
  /** CPU core to which the processor is bound. */
  core: number | null;
  /** True if the supervisor runs on the processor. */
  supervisor: boolean;
  /** Process in which the processor runs; null for that of the supervisor. */
  process: string | null;
  /** Host on which the processor runs; null for that of the supervisor. */
  host: string | null;
}

/** `raises` mark of a condition: a Boolean, or the name of the exception class, which only the programming system resolves. */
export type RaiseMark = boolean | string;

/** Permitted values of an item. As text: `[0, 1]`, `(0, inf)`, `[pose]`; a parenthesis excludes the bound. */
export type Range = string;

/** Rate at which a writer updates in one command list. */
export type Rate = {
  interval: {
    period_ns: number;
  };
} | {
  trigger: {
    source: string;
    every: number;
  };
} | "once";

/** A value with its number and time. */
export interface Reading {
  /** Value, unless bytes are requested. */
  value?: Value | null;
  /** Memory of the value's C type in base64, little-endian, if requested. */
  bytes?: string | null;
  number: number;
  time_ns: number;
}

/** State of a recording at a given time. */
export interface RecordedAt {
  /** Most recently stored values; null if there was none yet. */
  values: { [name: string]: Reading | null };
  /**
   * Most recent messages of other channels, with their times; null if there was none yet. Messages that the caller already has are
   * omitted.
   */
  messages: { [name: string]: RecordedMessage | null };
}

/** An SVV or private cell in a recording. */
export interface RecordedChannel {
  /** Name; the name of a cell is `INSTANCE:CELL`. */
  name: string;
  /** Kind: `svv` or `cell`. */
  kind: string;
  type_text: string;
  unit: string;
  /** Number of components of one value. */
  components: number;
}

/** An end of a verb instance. */
export interface RecordedEnd {
  instance: string;
  /** Condition that ended the instance. */
  condition: string;
  time_s: number;
}

/** A message of a channel without values. */
export interface RecordedMessage {
  /** Time on the system's clock. */
  time_ns: number;
  message: unknown;
}

/** Messages of a channel, in order. */
export interface RecordedMessages {
  messages: RecordedMessage[];
  /** Number of the next message if there may be more; pass it as `since`. */
  next: number | null;
}

/** Data of several channels over a span. */
export interface RecordedSpan {
  channels: RecordedTrace[];
  /**
   * Value of `since` for the call that continues this answer, if it is incomplete. The samples of the continuation follow these, and
   * its sums must be added to these.
   */
  next: number | null;
}

/** Digest of one component of a channel over a span; every finite value counts once. */
export interface RecordedSums {
  count: number;
  /** Minimum; 0 if there are no values. */
  min: number;
  max: number;
  sum: number;
  /** Sum of squares. */
  squares: number;
  /**
   * Sum of squared differences from the mean, updated directly: deriving it from the sum of squares would lose precision for large
   * values.
   */
  spread: number;
}

/** Data of one channel over a span. */
export interface RecordedTrace {
  /**
   * Samples: the last value stored before the span, then for each column the first value, the last value, and the values with the
   * minimum and maximum of each component, all as complete values with their own times. Base64, little-endian: (i64 time in ns, u64
   * number) of all samples, then the components as f64.
   */
  samples: string;
  /** Sums for each component, over all values of the span. */
  sums: RecordedSums[];
}

/** Answer to the call that starts a recording. */
export interface RecordingBegun {
  /** Number of the recording. */
  recording: number;
}

/** Description of the contents of a recording. */
export interface RecordingContents {
  /** Name of the recorded system. */
  system: string;
  /** Version of OpenGPAC that wrote the recording. */
  version: string;
  /** Clock of the system: `virtual` or `monotonic`. */
  clock: string;
  /** Time at which the system's clock was 0, s since the Unix epoch. */
  epoch_unix_s: number;
  /** Earliest and latest time in the recording, ns on the system's clock. */
  begins_ns: number;
  ends_ns: number;
  /** False if the file has no end record because it is still being recorded, its recorder was killed, or the disk was full. */
  complete: boolean;
  /** True if `opengpac replay` can replay the recording. */
  replay: boolean;
  channels: RecordedChannel[];
  /** Topics of the other channels, such as `/log` and `/ends`. */
  topics: string[];
  /** Installed verbs in alphabetical order; for a long recording, the verbs at its beginning. */
  verbs: string[];
  /** Ends of verb instances; for a long recording, only the first ones. */
  ends: RecordedEnd[];
  /** Number of lost messages by channel; channels without losses are omitted. */
  lost: { [name: string]: number };
  /** Unreadable parts of the file that have been found so far. The content of a chunk is checked when it is first read. */
  damage: DamagedPart[];
  /** Description of the system in the file: `configuration` is the answer to the `configuration` call as JSON. */
  metadata: { [name: string]: string };
}

/** A file in a folder of recordings. */
export interface RecordingFile {
  /** Name of the file without its folder. */
  name: string;
  /** Size of the file, bytes. */
  bytes: number;
  /** Time of the last write, s since the Unix epoch. */
  written_unix_s: number;
}

/** State of a recording; remains available after its end. */
export interface RecordingSummary {
  /** Path of the file, or of the first file if the recording is split. */
  path: string;
  /** Existing files, oldest first; the last one is being written. */
  files: string[];
  running: boolean;
  /** Number of written messages by channel; while the recording is in progress, only those in complete chunks. */
  counts: { [name: string]: number };
  /** Number of messages that could not be written, by channel; channels without losses are omitted. */
  lost: { [name: string]: number };
  /** Total size of the existing files, bytes. */
  bytes: number;
  /** Free space on the disk at the last write, bytes, if known. */
  free_bytes: number | null;
  /** Failure that ended the recording, if any. */
  failure: string | null;
}

/** A single mistake. */
export interface Refusal {
  class: Class;
  /** Message in lower case that names both ends: `cannot bind output 'a.y' (double, N.m) to input 'b.u' (float): types differ`. */
  message: string;
  ends?: RefusalEnd[];
  /** Next step, if known; printed after the message, following a semicolon. */
  remedy?: string;
  /** Location to check first: that of the faulty definition. */
  place?: SourceLocation | null;
  /** Parts of the definition involved, the main one first. */
  where?: Where[];
}

/** One end of the binding to which a refusal refers. */
export interface RefusalEnd {
  /** Name in the message, for example `output 'servo.effort' (double, N.m)`. */
  what: string;
  place?: SourceLocation | null;
}

/** A part of a layout: a row or a column of regions, tabs, or one panel. */
export interface Region {
  /** Share of the row or column, relative to its neighbours; 1 if omitted. */
  share?: number | null;
  /** Regions side by side. */
  row?: Region[];
  /** Regions arranged one above the other. */
  column?: Region[];
  /** Regions in the same place, of which only one is visible at a time. */
  tabs?: Region[];
  /** Content of the panel. */
  panel?: PanelKind | null;
  /** Heading of the panel; if empty, it is derived from the panel's content. */
  title?: string;
  /** SVVs and private cells of a plot, each at its full rate. */
  names?: string[];
  /** Time span of a plot, s, 0.1 to 600; 10 by default. */
  seconds?: number | null;
  /** Rows of a table of values. */
  values?: ShownValue[];
  /** Physical device that a scene draws. */
  device?: string | null;
  /** Verb of a state diagram. */
  verb?: string | null;
  /** Buttons, each of which starts one action. */
  buttons?: Button[];
}

/** A part of a layout: a row or a column of regions, tabs, or one panel. */
export interface RegionRequest {
  /** Share of the row or column, relative to its neighbours; 1 if omitted. */
  share?: number | null;
  /** Regions side by side. */
  row?: RegionRequest[];
  /** Regions arranged one above the other. */
  column?: RegionRequest[];
  /** Regions in the same place, of which only one is visible at a time. */
  tabs?: RegionRequest[];
  /** Content of the panel. */
  panel?: PanelKind | null;
  /** Heading of the panel; if empty, it is derived from the panel's content. */
  title?: string;
  /** SVVs and private cells of a plot, each at its full rate. */
  names?: string[];
  /** Time span of a plot, s, 0.1 to 600; 10 by default. */
  seconds?: number | null;
  /** Rows of a table of values. */
  values?: ShownValue[];
  /** Physical device that a scene draws. */
  device?: string | null;
  /** Verb of a state diagram. */
  verb?: string | null;
  /** Buttons, each of which starts one action. */
  buttons?: ButtonRequest[];
}

/** A remark about an implicit addition or another noteworthy fact, for example an implied cell or an edge that causes a delay. */
export interface Remark {
  text: string;
  place: SourceLocation | null;
}

/** Answer to the call that starts a replay. */
export interface ReplayBegun {
  /** Number of the replay. */
  replay: number;
}

/** Difference as human-readable text. */
export interface ReplayDifference {
  /** Source in which the difference occurred. */
  source: string;
  /** Number of the firing. */
  number: number;
  /** Release time of the firing, ns. */
  time_ns: number;
  /** True if the difference occurred between two firings. */
  between: boolean;
  /** Label of the block, with its instance; empty if unknown. */
  block: string;
  /** Port; empty if unknown. */
  port: string;
  /** SVV in which the value is stored; empty if it is a private cell or unknown. */
  svv: string;
  /** Type of the port. */
  type_text: string;
  /** Elements of the recorded value; hexadecimal digits if it contains no numbers. */
  recorded: string[];
  /** Elements of the replayed value, in the same format. */
  replayed: string[];
  /** Deviation of the execution of the source from the record; empty if there is none. */
  how: string;
  /** SVVs that blocks of the source store, with their current values; used if the block is unknown. */
  stored: ReplayShown[];
}

/** Position at which a replay stopped, and its findings. */
export interface ReplayFound {
  stopped: ReplayStopped;
  /** Number of firings that were replayed. */
  firings: number;
  /** Fingerprint of the run so far; identical for all records of one run. */
  fingerprint: string;
  /** True if every value so far equals that of the record, bit for bit. */
  same: boolean;
  /** Source of the last firing. */
  source: string;
  /** Number of the source's firing. */
  number: number;
  /** Release time of the firing, ns. */
  time_ns: number;
  /** The first difference. */
  difference: ReplayDifference | null;
  /** Reason why the record cannot be replayed further, and other notes. */
  message: string;
  /** Requested SVVs. */
  svvs: ReplayShown[];
}

/** An SVV at the end of a run. */
export interface ReplayShown {
  /** Name. */
  name: string;
  /** C type. */
  type_text: string;
  /** Unit. */
  unit: string;
  /** Elements of the value. */
  value: string[];
}

/** Reason why a run was stopped. */
export type ReplayStopped = "end" | "condition" | "time" | "difference" | "unplayable";

/** State of a replay. */
export interface Replaying {
  /** True while the replay runs. */
  running: boolean;
  /** Number of firings that were replayed. */
  firings: number;
  /** Release time of the last replayed firing, ns on the recording's clock; null before the first. */
  time_ns: number | null;
  /** Findings, once the replay has ended. */
  found: ReplayFound | null;
  /** Reason why the replay could not be run, or could not be completed. */
  failure: string | null;
}

/** The end of one start of a verb instance. */
export interface Report {
  instance: string;
  verb: string;
  /** Number of this start of the instance, counted from 1. */
  start: number;
  /** Termination condition. */
  condition: string;
  /** True for a normal end, which raises no exception in the programming system. */
  normal: boolean;
  /** Command list that was running. */
  command_list: string;
  /** Block that reported the condition, if any. */
  block: string | null;
  /** Time of the end, and time of the start, s on the system's clock. */
  time_s: number;
  started_s: number;
  /** Value that the condition reported, if it has one. */
  value: Value | null;
  /** Description of the cause. */
  message: string;
  /**
   * Output values of the condition that ended the verb and of all conditions that led to it: for each name the latest value, or null
   * if it was not reported in this start.
   */
  outputs: { [name: string]: Value | null };
  others: Other[];
  /** Transitions taken, in order; at most the last 64 are kept. */
  way: PassedList[];
}

/** Property that each device of an object must have when a verb starts. */
export interface Requirement {
  /** Parameter or SVV, such as `arm.needs_home`; the requirement applies only to devices for which it is true. */
  when: string | null;
  /** Class of the refusal if the requirement is not met. */
  raises: Class;
  remedy: string;
  place: SourceLocation | null;
}

/** Property that each device of an object must have when a verb starts. */
export interface RequirementRequest {
  /** Parameter or SVV, such as `arm.needs_home`; the requirement applies only to devices for which it is true. */
  when?: string | null;
  /** Class of the refusal if the requirement is not met. */
  raises: Class;
  remedy?: string;
  place?: SourceLocation | null;
}

/** An opened session, with the instances started by it that still exist. */
export interface Returned {
  /** ID of the session, for the header `OpenGPAC-Session`. */
  session: string;
  name: string;
  role: Role;
  /** Maximum interval between the session's signs of life, ms. */
  heartbeat_ms: number;
  /** Time without a sign of life after which the session is considered lost, ms. */
  lost_after_ms: number;
  /** True if the session existed before and was lost. */
  returned: boolean;
  /** Number of end reports that are kept for the session. */
  kept_reports: number;
  /** Number of end reports dropped because too many were waiting. */
  lost_reports: number;
  instances: SessionInstance[];
}

/** Role of a caller. */
export type Role = "observe" | "operate" | "configure" | "download";

/** A channel of a scope. */
export interface ScopeChannel {
  name: string;
  type_text: string;
  unit: string;
  /** Number of components of one value: elements of an array, members of a struct. */
  components: number;
}

/** Channels of a scope. */
export interface ScopeHead {
  /** Channels, in the order in which the binary frames number them. */
  channels: ScopeChannel[];
}

/** An entry in the list of sessions. */
export interface SessionInfo {
  name: string;
  /** Caller of the session: a user, a token or a certificate. */
  who: string;
  /** Name of the person who opened the session, if provided. */
  person: string | null;
  role: Role;
  /** Address of the caller. */
  from: string;
  /** True if the session has command. */
  commands: boolean;
  alive: boolean;
  /** True if a connection holds the session, in which case the session is lost as soon as the connection breaks. */
  held: boolean;
  kept_reports: number;
}

/** A verb instance of a session. */
export interface SessionInstance {
  instance: number;
  name: string;
  state: InstanceState;
}

/** A completed request for command. */
export interface SettledRequest {
  /** Number of the request, unique within the system. */
  number: number;
  /** Session that made the request. */
  name: string;
  outcome: Outcome;
  /** Session that granted, declined or withdrew the request; null if none did, for example after a timeout. */
  by: string | null;
  /** Human-readable reason. */
  reason: string;
}

/** Urgency of an alarm. */
export type Severity = "low" | "medium" | "high" | "critical";

/** Shelving of an alarm: a period for which it is removed from the list. */
export interface Shelving {
  /** Person or session that shelved the alarm. */
  who: string;
  reason: string;
  /**
   * Time at which the alarm was shelved, on the system's clock and on the wall clock (ns since the Unix epoch; if the system's clock
   * is virtual, its time is used for both).
   */
  time_ns: number;
  wall_ns: number;
  /** Time at which the shelving expires. */
  until_ns: number;
  /** Time at which the shelving ended; null as long as it lasts. */
  ended_ns: number | null;
  /** Person or session that ended the shelving; empty if it expired, or if it ended because the alarm can no longer be shelved. */
  ended_by: string;
}

/** Shelving of an alarm: a period for which it is removed from the list. */
export interface ShelvingRequest {
  /** Person or session that shelved the alarm. */
  who: string;
  reason: string;
  /**
   * Time at which the alarm was shelved, on the system's clock and on the wall clock (ns since the Unix epoch; if the system's clock
   * is virtual, its time is used for both).
   */
  time_ns: number;
  wall_ns: number;
  /** Time at which the shelving expires. */
  until_ns: number;
  /** Time at which the shelving ended; null as long as it lasts. */
  ended_ns?: number | null;
  /** Person or session that ended the shelving; empty if it expired, or if it ended because the alarm can no longer be shelved. */
  ended_by: string;
}

/** A command in short form: the name of the command is the key of its argument. */
export type ShortCommand = {
  install: NameList;
} | {
  execute: string;
} | {
  activate: string;
  every: Time | null;
  tunable: boolean;
  budget: Time | null;
} | {
  deactivate: string;
} | {
  wait: Until;
} | {
  ready: boolean;
};

/** A command in short form: the name of the command is the key of its argument. */
export type ShortCommandRequest = {
  install: NameList;
} | {
  execute: string;
} | {
  activate: string;
  every?: Time | null;
  tunable?: boolean;
  budget?: Time | null;
} | {
  deactivate: string;
} | {
  wait: Until;
} | {
  ready: boolean;
};

/** A value of a table: an SVV, a private cell or a channel. */
export interface ShownValue {
  name: string;
  /** Human-readable label; the name if empty. */
  label?: string;
  /** Lower limit, in the unit of the value; values below it are highlighted. */
  minimum?: number | null;
  /** Upper limit; values above it are highlighted. */
  maximum?: number | null;
}

/** A block that cannot be fused, and therefore runs on its own. */
export interface SingleBlock {
  /** Label of the block, as `instance.label`. */
  block: string;
  /** Reason why the block cannot be fused. */
  why: string;
}

/** Values at a single point in time. */
export interface Snapshot {
  time_ns: number;
  values: { [name: string]: Reading };
}

/** An interrupt source; its key in [`Configuration::sources`] is `rtp.name`. */
export interface Source {
  processor: string;
  kind: SourceKind;
  priority: number;
}

export type SourceKind = "trigger" | "software" | {
  timer: {
    period_ns: number;
  };
};

/** Source location of a definition in the user's program. */
export interface SourceLocation {
  file: string;
  line: number;
}

/**
 * Statistics of an interrupt source. Bin i of a histogram counts times from 2^i to 2^(i+1) ns; the first bin also counts shorter times,
 * and the last one longer times.
 */
export interface SourceStatistics {
  /** Number of steps in the source's firing table. */
  steps: number;
  /** Number of firings, excluding those of `execute`. */
  firings: number;
  /** Number of releases skipped because the previous firing had not finished. */
  overruns: number;
  /** Number of ratio values that were missing when their reader needed them. */
  late: number;
  /** Number of invocations that faulted. */
  faults: number;
  /** Number of conditions and other events that were lost because a queue was full. */
  lost: number;
  /** True if the source was stopped by a fault. */
  stopped: boolean;
  /** Privileges that the source's thread requested from the operating system but was not granted. */
  rights_missing: string[];
  /** Delay between the release of the last firing and its start, ns. */
  jitter_last_ns: number;
  /** Maximum jitter, ns. */
  jitter_max_ns: number;
  /** Histogram of the jitter. */
  jitter_bins: number[];
  /** Upper bound of the bin that contains the median jitter, ns; 0 before the first firing. */
  jitter_median_ns: number;
  /** Total duration of all firings, ns. */
  duration_sum_ns: number;
  /** Duration of the last firing, ns. */
  duration_last_ns: number;
  /** Maximum duration, ns. */
  duration_max_ns: number;
  /** Histogram of the durations. */
  duration_bins: number[];
  /** Upper bound of the bin that contains the median duration, ns; 0 before the first firing. */
  duration_median_ns: number;
  processor?: string;
  /** CPU core to which the source's processor is bound. */
  core?: number | null;
  kind?: KindOfSource;
  /** Period of a timer, ns. */
  period_ns?: number | null;
  priority?: number;
  /** Privileges that the source's thread requested from the operating system; empty under the virtual clock. */
  rights_asked?: string[];
  /** True if a probe is measuring the source's blocks. */
  probed: boolean;
  /** Durations of the blocks' invocations that a probe has measured since each block was installed. */
  blocks: BlockTimes[];
}

/** Statistics of a system. */
export interface Statistics {
  /** Time on the system's clock, s. */
  now_s: number;
  /** Interrupt sources by name, `rtp.source`. */
  sources: { [name: string]: SourceStatistics };
  /** Verb instances in order of creation. */
  instances: InstanceStatistics[];
  /** States of the logical devices. */
  devices: { [name: string]: DeviceState };
  physical_devices: { [name: string]: PhysicalDeviceStatistics };
  /** Processors outside the supervisor's process, by process. */
  processes: { [name: string]: string[] };
  /** Cause of the latched emergency stop; null if it is not latched. */
  emergency: string | null;
  paused: PausesInForce;
  mode: Mode;
  /** Forced signals, by logical device. */
  forced: { [name: string]: ForcedSignal };
  /** Privileges that the supervisor's thread requested from the operating system but was not granted. */
  supervisor_rights_missing: string[];
}

/** An entry of the augmented τ. */
export interface Step {
  /**
   * Parts or lists from which the entry leads: `approach`, `approach.back_off`. A part stands for each of its lists that the condition
   * ends.
   */
  from: NameList;
  /** Condition, by its name in the composed verb or in the part; if absent, every normal end except a halt. */
  condition?: string | null;
  /** Target of the entry: a list, or a part, which stands for its initial list. */
  to: string;
  place?: SourceLocation | null;
}

/** A stored file. */
export interface StoredFile {
  /** Size of the file, bytes. */
  bytes: number;
}

/** A text frame of the stream: an update of a subscription, or the reason why a frame of the client was refused. */
export interface StreamAnswer {
  /** Name that the client chose for the subscription. */
  id?: string | null;
  /** Heartbeat of a stream opened with `?beat=true`: the daemon's clock, ms. `OpenGPAC-As-Of` is relative to it. */
  beat?: number | null;
  svvs?: Snapshot | null;
  statistics?: Statistics | null;
  installed?: InstalledInstances | null;
  log?: LogEntry[] | null;
  ends?: End[] | null;
  /** First frame of a scope, which describes the content of the binary frames that follow. */
  scope?: ScopeHead | null;
  /** Number of frames or entries of this subscription dropped since its last frame because the reader was too slow. */
  dropped?: number | null;
  /** Reason why the subscription ended or the frame was refused. */
  errors?: Refusal[] | null;
}

/** A frame that the client of a stream sends. */
export interface StreamFrame {
  /** Topic of the subscription. */
  subscribe?: Topic | null;
  /** Name that the client chose for the subscription. */
  id?: string | null;
  /** Name of the subscription to end. */
  unsubscribe?: string | null;
  /** SVVs and cells to observe, for the topics `svvs` and `scope`. */
  names?: string[];
  /** Observation period, ms of wall-clock time: at least 10; at least 100 for `statistics` and `installed`; at most 1,000 for `scope`. */
  every_ms?: number;
  /** True if the topic `svvs` sends base64-encoded bytes instead of values. */
  raw?: boolean;
  /** Number of the first entry of `log` or `ends` to send. */
  since?: number;
}

/**
 * Suspension of a verb. JSON: `"idle"`, `"hold"`, `"hold_last"`, `"safe"`, or `{"holding": [{"set": "label.input", "until":
 * "label.condition"}]}`.
 */
export type Suspend = "idle" | "hold" | "hold_last" | "safe" | {
  holding: Holding[];
};

/** An SVV, a private cell of an instance (`move#1:coefficients`) or a channel of a physical device (`plant.elbow.position`). */
export interface SvvAbout {
  name: string;
  kind: CellKind;
  /** C type as declared. */
  type_text: string;
  /** Declarations of the struct types used by the type, by name. */
  types: { [name: string]: string };
  /** Type with its layout. */
  type: TypeTree;
  unit: string;
  /** Number of values kept. */
  history: number;
  /** Logical device to which the SVV belongs. */
  device: string | null;
  /** Ports that write the value, as `instance.label.port`. */
  writers: string[];
  /** Ports that read the value. */
  readers: string[];
  /** Number of verb instances that have a port bound to the value. */
  bound: number;
  /** Number of this SVV among all SVVs that have ever had the same name; `NAME@ID` refers to exactly this one. */
  id?: number;
  /** Minimum and maximum that a programming system may write, if both are finite. */
  within?: [number, number] | null;
  /** Interrupt source that computed the current value; null if a programming system wrote it. */
  source?: string | null;
}

export type SvvId = number;

/** A requested SVV: its specification, and the struct types used by its type. */
export interface SvvRequest {
  /** C type. */
  type_text: string;
  unit?: string;
  initial?: Initial | null;
  /** Number of previous values kept for Python. */
  history?: number;
  /** Range of values that the PS may store. */
  within?: Within | null;
  /** True if the PS keeps the value across a warm restart. */
  keep?: boolean | null;
  /** Name of the system's SVV that all devices of the type share instead of each having its own. */
  shared?: string | null;
  types?: { [name: string]: string };
}

export interface SvvSpecification {
  /** C type. */
  type_text: string;
  unit: string;
  initial: Initial | null;
  /** Number of previous values kept for Python. */
  history: number;
  /** Range of values that the PS may store. */
  within: Within | null;
  /** True if the PS keeps the value across a warm restart. */
  keep?: boolean | null;
  /** Name of the system's SVV that all devices of the type share instead of each having its own. */
  shared: string | null;
}

export interface SvvSpecificationRequest {
  /** C type. */
  type_text: string;
  unit?: string;
  initial?: Initial | null;
  /** Number of previous values kept for Python. */
  history?: number;
  /** Range of values that the PS may store. */
  within?: Within | null;
  /** True if the PS keeps the value across a warm restart. */
  keep?: boolean | null;
  /** Name of the system's SVV that all devices of the type share instead of each having its own. */
  shared?: string | null;
}

/** Body of `POST /v1/command`. */
export interface TakeCommand {
  /** True to take command from the holder; requires the role `configure`. */
  force?: boolean;
}

/** Results of a takeover, one per process that contains processors. */
export interface TakenOver {
  /** Results, sorted by process name. */
  processors: ProcessTakenOver[];
}

/** A taught point: joint positions, or a pose in a frame with the joints at which it was taught. */
export interface TaughtPoint {
  name: string;
  /** Joint positions at the time of teaching, in the order of the arm, rad or m. */
  joints: number[];
  /** `joints` for joint positions; `world` or the name of a work frame for a pose. */
  frame: string;
  /** Frame in `tools` to which the pose applies; null for the tool of the arm. */
  tool: string | null;
  /** Position in its frame, m. */
  position: [number, number, number] | null;
  /** Roll, pitch and yaw in its frame, degrees. */
  rpy_deg: [number, number, number] | null;
  /** Signs of the shoulder, elbow and wrist configuration, if the arm has such configurations. */
  configuration: string | null;
  /** Revolutions of the joints in that configuration. */
  turns: number[];
  /** Free-text comment. */
  note: string;
  /** Time of teaching, RFC 3339. */
  taught: string | null;
}

/** A taught point: joint positions, or a pose in a frame with the joints at which it was taught. */
export interface TaughtPointRequest {
  name: string;
  /** Joint positions at the time of teaching, in the order of the arm, rad or m. */
  joints: number[];
  /** `joints` for joint positions; `world` or the name of a work frame for a pose. */
  frame?: string;
  /** Frame in `tools` to which the pose applies; null for the tool of the arm. */
  tool?: string | null;
  /** Position in its frame, m. */
  position?: [number, number, number] | null;
  /** Roll, pitch and yaw in its frame, degrees. */
  rpy_deg?: [number, number, number] | null;
  /** Signs of the shoulder, elbow and wrist configuration, if the arm has such configurations. */
  configuration?: string | null;
  /** Revolutions of the joints in that configuration. */
  turns?: number[];
  /** Free-text comment. */
  note?: string;
  /** Time of teaching, RFC 3339. */
  taught?: string | null;
}

/** The taught points of an arm. */
export interface TaughtPoints {
  /** Path of the file on the host of the system. */
  file: string;
  /** Joints of the arm, by their short names. */
  joints: string[];
  /** Points, in the order of the file. */
  points: TaughtPoint[];
  frames: NamedFrame[];
  tools: NamedFrame[];
}

/** A termination condition: an element of t_V with its ν. */
export interface Termination {
  /** Block conditions (`label.item`) that make up this condition; if empty, the system condition with the same name. */
  on: NameList;
  /** ν: outputs that the condition returns; absent if none is declared. */
  returns: NameList | null;
  /**
   * True if the condition raises an exception in the PS. In JSON, may also be the name of the exception class, which only the PS
   * resolves.
   */
  raises: RaiseMark;
  /** Command lists in which the condition holds (in JSON, one name or several); if empty, all. */
  during: NameList;
  priority: number;
  /** Code of the alarm that the condition raises whenever it occurs, whether or not the verb ends. */
  alarm: string | null;
  place: SourceLocation | null;
}

/** A termination condition: an element of t_V with its ν. */
export interface TerminationRequest {
  /** Block conditions (`label.item`) that make up this condition; if empty, the system condition with the same name. */
  on?: NameList;
  /** ν: outputs that the condition returns; absent if none is declared. */
  returns?: NameList | null;
  /**
   * True if the condition raises an exception in the PS. In JSON, may also be the name of the exception class, which only the PS
   * resolves.
   */
  raises?: RaiseMark;
  /** Command lists in which the condition holds (in JSON, one name or several); if empty, all. */
  during?: NameList;
  priority?: number;
  /** Code of the alarm that the condition raises whenever it occurs, whether or not the verb ends. */
  alarm?: string | null;
  place?: SourceLocation | null;
}

/** A time with its unit: `20 ms`. */
export type Time = string;

/** Ending rule of parts that run together. */
export type TogetherUntil = "any" | "all";

/**
 * Topic of a stream. `scope` sends every value of the selected SVVs and private cells in binary frames; `installed` is sent at the start
 * and whenever it changes.
 */
export type Topic = "svvs" | "log" | "ends" | "scope" | "statistics" | "installed";

/** Transition of τ: the list to which a condition leads from another list. */
export interface Transition {
  from: string;
  condition: string;
  to: string;
  place: SourceLocation | null;
}

/** Transition of τ: the list to which a condition leads from another list. */
export interface TransitionRequest {
  from: string;
  condition: string;
  to: string;
  place?: SourceLocation | null;
}

/** A C type with its layout. */
export type TypeTree = ({
  scalar: string;
} | {
  array: [TypeTree, number];
} | {
  struct: [string, TypeTree, number][];
}) & {
  /** Normalised declaration. */
  text: string;
  /** Size of a value in bytes, including padding. */
  size: number;
  /** Alignment, bytes. */
  align: number;
};

/** End of a wait. */
export type Until = boolean | NameList;

/** A value of a parameter, preset, SVV or output. In JSON, it has the corresponding native representation. */
export type Value = boolean | number | string | Value[] | { [name: string]: Value } | null;

/**
 * A verb (f_V, p_V, o_V, inst_V, χ, ψ, ω, c_V, t_V, τ, ν).
 *
 * In a composed verb (one with `parts`), blocks, cells and lists carry the label of their part (`close.start`). So do the keys of
 * `conditions` and `output_values`, which may then have one entry per part; [`Verb::reported`] returns their names in reports and τ.
 */
export interface Verb {
  name: string;
  doc: string;
  /** True if the verb may be started in manual mode. */
  manual: boolean;
  blocks: { [name: string]: WrittenBlockUse };
  objects: { [name: string]: WrittenObject };
  /** χ: parameter (`sensed`, `drive.position`, `arm.commanded`) → data nodes. */
  instantiation_parameters: { [name: string]: NameList };
  /** Private SVVs of each instance; part of χ. */
  cells: { [name: string]: NameList };
  input_parameters: { [name: string]: WrittenInputParameter };
  /** Boolean members of objects (SVVs or parameters) that must be true when the verb starts: `arm.homed`. */
  requires: { [name: string]: WrittenRequirement };
  /** ω. */
  output_values: { [name: string]: string };
  command_lists: { [name: string]: WrittenCommandList };
  initial: string | null;
  conditions: { [name: string]: WrittenTermination };
  transitions: Transition[];
  /** Relaxed modes: port → mode. */
  modes: { [name: string]: PortMode };
  /** Parts of a composed verb by label, including nested parts (`pick.approach`). Empty if the verb is not composed. */
  parts: { [name: string]: Part };
  /**
   * Command list that runs at every end (brakes, a ramp down), except after an emergency stop, the loss of a processor or a second
   * halt.
   */
  ending: string | null;
  /**
   * Time limit, ns, for an ending list, for the lists to which τ leads after a device was disabled or after an abort, and for a
   * suspension that waits for its condition; if absent, [`ENDING_LIMIT_NS`].
   */
  ending_limit_ns: number | null;
  suspend: Suspend;
  /**
   * Reaction of a running instance when the programming system that started it is cut off; if absent, an action is halted, and a
   * logical device's own verb continues.
   */
  if_cut_off: IfCutOff | null;
  place: SourceLocation | null;
}

/** Class of a verb: one of the two defined in the paper. */
export type VerbClass = "acts on devices" | "supports devices";

/** Contents of a form for starting a verb. */
export interface VerbForm {
  name: string;
  doc: string;
  /** True if the verb may be started in manual mode. */
  manual: boolean;
  /** Arguments needed to create an instance. */
  arguments: FormArgument[];
  /** Values that may be passed to a start. */
  inputs: FormInput[];
  /** Definition of the verb. */
  defined: Verb;
}

/**
 * A verb (f_V, p_V, o_V, inst_V, χ, ψ, ω, c_V, t_V, τ, ν).
 *
 * In a composed verb (one with `parts`), blocks, cells and lists carry the label of their part (`close.start`). So do the keys of
 * `conditions` and `output_values`, which may then have one entry per part; [`Verb::reported`] returns their names in reports and τ.
 */
export interface VerbRequest {
  name: string;
  doc?: string;
  /** True if the verb may be started in manual mode. */
  manual?: boolean;
  blocks: { [name: string]: WrittenBlockUseRequest };
  objects?: { [name: string]: WrittenObjectRequest };
  /** χ: parameter (`sensed`, `drive.position`, `arm.commanded`) → data nodes. */
  instantiation_parameters?: { [name: string]: NameList };
  /** Private SVVs of each instance; part of χ. */
  cells?: { [name: string]: NameList };
  input_parameters?: { [name: string]: WrittenInputParameterRequest };
  /** Boolean members of objects (SVVs or parameters) that must be true when the verb starts: `arm.homed`. */
  requires?: { [name: string]: WrittenRequirementRequest };
  /** ω. */
  output_values?: { [name: string]: string };
  command_lists: { [name: string]: WrittenCommandListRequest };
  initial?: string | null;
  conditions?: { [name: string]: WrittenTerminationRequest };
  transitions?: TransitionRequest[];
  /** Relaxed modes: port → mode. */
  modes?: { [name: string]: PortMode };
  /** Parts of a composed verb by label, including nested parts (`pick.approach`). Empty if the verb is not composed. */
  parts?: { [name: string]: Part };
  /**
   * Command list that runs at every end (brakes, a ramp down), except after an emergency stop, the loss of a processor or a second
   * halt.
   */
  ending?: string | null;
  /**
   * Time limit, ns, for an ending list, for the lists to which τ leads after a device was disabled or after an abort, and for a
   * suspension that waits for its condition; if absent, [`ENDING_LIMIT_NS`].
   */
  ending_limit_ns?: number | null;
  suspend?: Suspend;
  /**
   * Reaction of a running instance when the programming system that started it is cut off; if absent, an action is halted, and a
   * logical device's own verb continues.
   */
  if_cut_off?: IfCutOff | null;
  place?: SourceLocation | null;
}

/** A one-line summary of a verb. */
export interface VerbSummary {
  name: string;
  doc: string;
  class: VerbClass;
  /** Device types that the verb supports. */
  supports: string[];
  /** True if the verb has only one command list. */
  simple: boolean;
  /** Names of the verb's command lists. */
  lists: string[];
  /** Parts of a composed verb, by label. */
  parts: { [name: string]: Part };
}

/** A port, and the reason why it cannot be wired, if it cannot. */
export interface Verdict {
  block: string;
  port: string;
  reason: string | null;
}

/** Version of the server, and the caller as the server sees it. */
export interface Version {
  /** Version of OpenGPAC. */
  opengpac: string;
  /** Version of the control interface. */
  interface: number;
  /** Version of the binary block interface of shared objects. */
  abi: number;
  /** Target platform for shared objects on this machine, such as `x86_64-linux`. */
  target: string;
  /** Name of the real-time system. */
  system: string;
  /**
   * Identifier of this run of the system. It changes when the system restarts, because the numbering of log entries and other items
   * then restarts as well.
   */
  run: string;
  clock: ClockName;
  /** Role of the caller. */
  role: Role;
}

/**
 * Part of a definition, as a drawing editor identifies it. JSON: `{"block": "filter", "port": "u"}`, `{"transition": ["start",
 * "contact"]}`, …
 */
export type Where = {
  block: string;
  port: string;
} | {
  block: string;
} | {
  cell: string;
} | {
  parameter: string;
} | {
  output: string;
} | {
  object: string;
} | {
  list: string;
  command: number;
} | {
  list: string;
} | {
  condition: string;
} | {
  transition: [string, string];
};

/** Body of `DELETE /v1/command/request`. */
export interface WithdrawRequest {
  /** Human-readable reason. */
  reason?: string;
}

/**
 * Range of a member of a device type, or of an SVV. JSON: `"(0, inf)"`, or two bounds, each a number or the name of a parameter of the
 * device, for example `["position_min", "position_max"]` or `["-max_effort", "max_effort"]`.
 */
export type Within = Range | [Bound, Bound];

/** A layout of panels. */
export interface Workspace {
  /** Name, unique among the workspaces of the system. */
  name: string;
  /** Human-readable title; the name if empty. */
  title?: string;
  /** Purpose of the workspace. */
  doc?: string;
  /** True if the workspace is for operators: it has large buttons and values, and no part of it can be edited. */
  operator?: boolean;
  layout: Region;
}

/** A one-line summary of a workspace. */
export interface WorkspaceAbout {
  name: string;
  title: string;
  doc: string;
  /** True if the workspace is for operators. */
  operator: boolean;
  /** True if a program has supplied the workspace; people cannot change such a workspace. */
  shipped: boolean;
  /** Revision number; every change assigns a new one. */
  revision: number;
}

/** A layout of panels. */
export interface WorkspaceRequest {
  /** Name, unique among the workspaces of the system. */
  name: string;
  /** Human-readable title; the name if empty. */
  title?: string;
  /** Purpose of the workspace. */
  doc?: string;
  /** True if the workspace is for operators: it has large buttons and values, and no part of it can be edited. */
  operator?: boolean;
  layout: RegionRequest;
}

export type WrittenBlockSource = string | BlockSource;

export type WrittenBlockSourceRequest = string | BlockSourceRequest;

export type WrittenBlockUse = string | BlockUse;

export type WrittenBlockUseRequest = string | BlockUseRequest;

/** A command in long or short form. */
export type WrittenCommand = Command | ShortCommand;

export type WrittenCommandList = Commands | CommandList;

export type WrittenCommandListRequest = CommandsRequest | CommandListRequest;

/** A command in long or short form. */
export type WrittenCommandRequest = CommandRequest | ShortCommandRequest;

export type WrittenInputParameter = NameList | InputParameter;

export type WrittenInputParameterRequest = NameList | InputParameterRequest;

export type WrittenObject = string | Object;

export type WrittenObjectRequest = string | ObjectRequest;

export type WrittenRequirement = string | Requirement;

export type WrittenRequirementRequest = string | RequirementRequest;

export type WrittenTermination = NameList | Termination;

export type WrittenTerminationRequest = NameList | TerminationRequest;

/** The calls: the least role that may make each, its arguments, its answer. */
export interface Calls {
  /** Creates a real-time processor. */
  processor: {
    role: "configure";
    arguments: {
      name: string;
      /** CPU core to which the processor is bound. */
      core?: number | null;
      /** True if the supervisor runs on the processor; by default it runs on the first one. */
      supervisor?: boolean;
      /** True for its own process, or the name of a shared process. */
      process?: InProcess;
      /** Name of a host that has joined the system. */
      host?: string | null;
      /** Maximum time for which the process may hang before it counts as lost. */
      lost_after_ns?: number | null;
      /** Maximum time for which the process may be without a supervisor. */
      patience_ns?: number | null;
    };
    result: null;
  };
  /** Allows other hosts to join the system. */
  listen: {
    role: "download";
    arguments: {
      /** "tcp/HOST:PORT" or "tls/HOST:PORT". */
      endpoint: string;
      /** Name of this host. */
      name: string;
      /** File of the certificate authority that signs the other hosts' certificates. */
      authority?: string | null;
      certificate?: string | null;
      key?: string | null;
      /** Secret that a host must present to join. */
      token?: string | null;
      /** Maximum difference between the clocks. */
      clock_limit_ns?: number | null;
    };
    result: null;
  };
  /** Takes over processes that lost a system with this name, and continues everything that runs in them; the system must be opened with "adopt": true. */
  take_over: {
    role: "configure";
    arguments: Record<string, never>;
    result: TakenOver;
  };
  /** Creates an interrupt source on a processor. */
  source: {
    role: "configure";
    arguments: {
      processor: string;
      name: string;
      /** "timer", "trigger" or "software". */
      kind: string;
      /** Period of a timer. */
      period_ns?: number;
      priority: number;
      /** Duration of a firing under the virtual clock. */
      virtual_cost_ns?: number;
    };
    result: null;
  };
  /** Requests one firing of a software source. */
  request: {
    role: "operate";
    arguments: {
      /** "processor.source". */
      source: string;
    };
    result: null;
  };
  /** Opens a device on a source. Returns its channels and parts. */
  physical_device: {
    role: "configure";
    arguments: {
      processor: string;
      name: string;
      /** Driver: "mujoco", "loopback", "scripted", ... */
      kind: string;
      /** Options of the driver. */
      options?: { [name: string]: unknown } | null;
      source: string;
      place?: SourceLocation | null;
    };
    result: PhysicalDevice;
  };
  /** Calls an acyclic service of a device's driver. Returns the service's answer. */
  device_service: {
    role: "operate";
    arguments: {
      device: string;
      /** Service declared by the driver, as listed by `configuration`. */
      service: string;
      /** Arguments of the service. */
      arguments?: { [name: string]: unknown } | null;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: Value | null;
  };
  /** Searches the host of the system for devices that a driver could open; does not move any machine. Returns a description of each device, and the options that open it. */
  scan_devices: {
    role: "configure";
    arguments: {
      /** Name of the driver. */
      kind: string;
      /** Options of the driver that define the search. */
      options?: { [name: string]: unknown } | null;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: Value | null;
  };
  /** Waits for a service or search in progress. Returns its answer, but only once. */
  device_served: {
    role: "operate";
    arguments: {
      errand: number;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: Value | null;
  };
  /** Reopens a lost device with all its bindings. */
  reopen_physical_device: {
    role: "operate";
    arguments: {
      name: string;
    };
    result: null;
  };
  /** Closes a device. */
  delete_physical_device: {
    role: "configure";
    arguments: {
      name: string;
    };
    result: null;
  };
  /** Makes a channel of a device raise a source. */
  raises: {
    role: "configure";
    arguments: {
      device: string;
      channel: string;
      source: string;
      place?: SourceLocation | null;
    };
    result: null;
  };
  /** Sets the placement of blocks that are not placed otherwise: label pattern → source. */
  place: {
    role: "configure";
    arguments: { [name: string]: string };
    result: null;
  };
  /** Defines a verb. */
  define_verb: {
    role: "configure";
    arguments: VerbRequest;
    result: null;
  };
  /** Checks a data flow graph, and refuses it if it has mistakes. Does not define it. */
  check_graph: {
    role: "observe";
    arguments: GraphRequest;
    result: null;
  };
  /** Returns all mistakes of a graph or a verb, each with its location in "where". Does not define it. */
  check_definition: {
    role: "observe";
    arguments: Drawing;
    result: Refusal[];
  };
  /** Returns all mistakes of a graph or a verb, as `check_definition` does, and everything that an installation would refuse regardless of the arguments: constants, defaults, members of objects, second writers in a list. Does not define it. */
  check_drawing: {
    role: "observe";
    arguments: Drawing;
    result: Refusal[];
  };
  /** Returns the reason why two ports of a graph or a verb cannot be wired together, or null if they can; without `to`, returns the reason for every other port. */
  compatible: {
    role: "observe";
    arguments: ({
      from: PortName;
      to?: PortName | null;
    }) & Drawing;
    result: PortVerdicts;
  };
  /** Defines a type of logical devices. */
  define_device_type: {
    role: "configure";
    arguments: DeviceTypeRequest;
    result: null;
  };
  /** Returns the verb that a composition of verbs defines, without defining it in the system. */
  compose: {
    role: "observe";
    arguments: Composition;
    result: Verb;
  };
  /** Creates an SVV. */
  svv: {
    role: "configure";
    arguments: ({
      name: string;
      place?: SourceLocation | null;
    }) & SvvRequest;
    result: null;
  };
  /** Deletes an SVV to which no port is bound. */
  delete_svv: {
    role: "configure";
    arguments: {
      name: string;
    };
    result: null;
  };
  /** Returns all blocks of the library and of code modules. */
  library: {
    role: "observe";
    arguments: Record<string, never>;
    result: Interface[];
  };
  /** Fuses C blocks that are always due together, for up to a second; call again as long as there are groups `waiting`. Returns the fused blocks. */
  fuse: {
    role: "configure";
    arguments: {
      /** False to undo fusing. */
      on?: boolean | null;
    };
    result: FusedBlocks;
  };
  /** Returns the fused blocks, and the other blocks with the reasons. */
  fused: {
    role: "observe";
    arguments: Record<string, never>;
    result: FusedBlocks;
  };
  /** Creates a logical device with its own verb instance. */
  device: {
    role: "configure";
    arguments: {
      name: string;
    } & DeviceRequest;
    result: null;
  };
  /** Starts a device's own verb. Returns its instance, or 0 if there is none. The device is enabled when the verb is ready. */
  enable: {
    role: "operate";
    arguments: {
      name: string;
    };
    result: number;
  };
  /** Waits until a device is enabled. Returns true if the device is enabled. */
  wait_enabled: {
    role: "observe";
    arguments: {
      name: string;
      /** Timeout relative to the call, on the system's clock. */
      timeout_ns?: number | null;
      /** Absolute deadline, as an alternative to the timeout. */
      until_ns?: number | null;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: boolean;
  };
  /** Ends the verbs that use a device, then the device's own verb, and waits until they have ended. */
  disable: {
    role: "operate";
    arguments: {
      name: string;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: null;
  };
  /** Replaces a device's own verb with another one, within one firing if the device is enabled. */
  exchange_verb: {
    role: "configure";
    arguments: {
      device: string;
      verb: string;
      place?: SourceLocation | null;
    };
    result: null;
  };
  /** Deletes a device. */
  delete_device: {
    role: "configure";
    arguments: {
      name: string;
    };
    result: null;
  };
  /** Returns the state of a device: "disabled", "enabling", "standstill", "moving", "stopping" or "fault". */
  device_state: {
    role: "observe";
    arguments: {
      name: string;
    };
    result: DeviceState;
  };
  /** Returns the value of a device parameter. */
  device_parameter: {
    role: "observe";
    arguments: {
      name: string;
      parameter: string;
    };
    result: Value;
  };
  /** Sets a device parameter. */
  set_device_parameter: {
    role: "operate";
    arguments: {
      name: string;
      parameter: string;
      value: Value;
    };
    result: null;
  };
  /** Registers an arm, replacing any arm with the same name: its joints, and the geometry that connects them or the reason why it is unknown. */
  describe_arm: {
    role: "configure";
    arguments: ArmDescriptionRequest;
    result: null;
  };
  /** Returns the arms whose joints all exist. */
  arms: {
    role: "observe";
    arguments: Record<string, never>;
    result: ArmDescription[];
  };
  /** Reads the taught points of an arm from its file, with its frames and tools. */
  points: {
    role: "observe";
    arguments: {
      arm: string;
    };
    result: TaughtPoints;
  };
  /** Stores a taught point in the file of an arm, replacing any point with the same name. */
  teach_point: {
    role: "operate";
    arguments: {
      arm: string;
      point: TaughtPointRequest;
    };
    result: null;
  };
  /** Renames a taught point; its position in the file is kept. */
  rename_point: {
    role: "operate";
    arguments: {
      arm: string;
      name: string;
      to: string;
    };
    result: null;
  };
  /** Removes a taught point and returns it. */
  delete_point: {
    role: "operate";
    arguments: {
      arm: string;
      name: string;
    };
    result: TaughtPoint;
  };
  /** Plans an application without creating an instance. Returns the plan. */
  check: {
    role: "observe";
    arguments: ApplicationRequest;
    result: Plan;
  };
  /** Calls a verb: creates an instance, starts it with the values of the application, waits until it has ended, and deletes it. Returns its end report. */
  perform: {
    role: "operate";
    arguments: {
      limits?: Limits;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    } & ApplicationRequest;
    result: Report | null;
  };
  /** Continues a verb call: waits until its instance has ended, and deletes it. Returns its end report. */
  performed: {
    role: "operate";
    arguments: {
      instance: number;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: Report | null;
  };
  /** Creates an instance. Returns its number. */
  create: {
    role: "operate";
    arguments: ApplicationRequest;
    result: number;
  };
  /** Starts an instance. */
  start: {
    role: "operate";
    arguments: {
      instance: number;
      /** Input parameter → value. */
      values?: { [name: string]: Value };
      limits?: Limits;
    };
    result: null;
  };
  /** Waits until an instance has ended. Returns its end report, or null after the timeout. */
  wait: {
    role: "observe";
    arguments: {
      instance: number;
      /** Timeout relative to the call, on the system's clock. */
      timeout_ns?: number | null;
      /** Absolute deadline, as an alternative to the timeout. */
      until_ns?: number | null;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: Report | null;
  };
  /** Ends an instance and waits until it has ended. First follows a transition on `halted`, if there is one; a second halt is immediate. Returns the end report. */
  halt: {
    role: "operate";
    arguments: {
      instance: number;
      /** Timeout relative to the call, on the system's clock. */
      timeout_ns?: number | null;
      /** Absolute deadline, as an alternative to the timeout. */
      until_ns?: number | null;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: Report | null;
  };
  /** Suspends an instance after its current step is complete. */
  suspend: {
    role: "operate";
    arguments: {
      instance: number;
    };
    result: null;
  };
  /** Resumes a suspended instance. */
  resume: {
    role: "operate";
    arguments: {
      instance: number;
    };
    result: null;
  };
  /** Deletes an instance that has ended. */
  delete: {
    role: "operate";
    arguments: {
      instance: number;
    };
    result: null;
  };
  /** Returns the state of an instance: "created", "queued", "running", "suspended", "ended" or "deleted". */
  state: {
    role: "observe";
    arguments: {
      instance: number;
    };
    result: InstanceState;
  };
  /** Returns the name, verb, state, blocks, conditions and lists of an instance. */
  instance: {
    role: "observe";
    arguments: {
      instance: number;
    };
    result: InstanceAbout;
  };
  /** Returns the end report of the latest start; null while it is running. */
  report: {
    role: "observe";
    arguments: {
      instance: number;
    };
    result: Report | null;
  };
  /** Sets tunable input parameters and intervals of a running instance. */
  set: {
    role: "operate";
    arguments: {
      instance: number;
      /** Input parameter → value. */
      values?: { [name: string]: Value };
      /** Label of a block → interval. */
      every_ns?: { [name: string]: number };
    };
    result: null;
  };
  /** Returns one consistent snapshot. */
  read: {
    role: "observe";
    arguments: {
      /** Names of SVVs, of private cells ("move#1:coefficients"), or of channels ("plant.elbow.position"). */
      names: string[];
      /**
       * True to return "bytes", the memory of the C type in base64, little-endian, instead of "value", which cannot represent NaN
       * or infinity in JSON.
       */
      raw?: boolean;
    };
    result: Snapshot;
  };
  /** Stores a value. */
  write: {
    role: "operate";
    arguments: {
      name: string;
      value: Value;
    };
    result: null;
  };
  /** Returns the most recent values, oldest first. */
  history: {
    role: "observe";
    arguments: {
      name: string;
      /** Maximum number of values. */
      count: number;
      /** True to return "bytes" instead of "value", as in `read`. */
      raw?: boolean;
    };
    result: Reading[];
  };
  /** Returns the properties of an SVV, a private cell or a channel: its type, unit, history and writers. */
  svv_about: {
    role: "observe";
    arguments: {
      name: string;
    };
    result: SvvAbout;
  };
  /** Returns the time on the system's clock, ns. */
  now: {
    role: "observe";
    arguments: Record<string, never>;
    result: number;
  };
  /** Runs the firings in (now, now + duration] under the virtual clock. */
  advance: {
    role: "operate";
    arguments: {
      duration_ns: number;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: null;
  };
  /** Runs the next firing under the virtual clock, however far ahead it is. Returns false if nothing will ever be due. */
  step: {
    role: "operate";
    arguments: Record<string, never>;
    result: boolean;
  };
  /** Stops everything that moves. The stop is latched until `reset` is called. */
  emergency_stop: {
    role: "operate";
    arguments: {
      reason: string;
    };
    result: null;
  };
  /** Makes a channel of a device trip the emergency stop. */
  emergency_stop_input: {
    role: "configure";
    arguments: {
      device: string;
      channel: string;
      /** True if the channel trips the emergency stop at zero rather than at one. */
      at_zero?: boolean;
    };
    result: null;
  };
  /** Resets the emergency stop, and reopens lost devices. Returns the devices that are still lost, with the reasons. */
  reset: {
    role: "operate";
    arguments: Record<string, never>;
    result: { [name: string]: string };
  };
  /** Suspends all actions on these logical devices, or on all devices, and waits until they are suspended. Returns the names of the suspended instances. */
  pause: {
    role: "operate";
    arguments: {
      devices?: string[] | null;
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: string[];
  };
  /** Waits until these instances are no longer running. Returns their names. */
  paused: {
    role: "operate";
    arguments: {
      instances: number[];
      names: string[];
      /** Time limit of this request, ms. */
      slice_ms?: number;
    };
    result: string[];
  };
  /** Ends a pause. Returns the names of the instances that resume or begin. */
  resume_program: {
    role: "operate";
    arguments: {
      devices?: string[] | null;
    };
    result: string[];
  };
  /** Returns the mode: "automatic" or "manual". */
  mode: {
    role: "observe";
    arguments: Record<string, never>;
    result: Mode;
  };
  /** Changes the mode. */
  set_mode: {
    role: "operate";
    arguments: {
      mode: Mode;
    };
    result: null;
  };
  /** Sets the channel of the enabling switch, without which nothing moves in manual mode. */
  enabling_switch: {
    role: "configure";
    arguments: {
      device: string;
      channel: string;
    };
    result: null;
  };
  /** Forces a signal, identified by its logical device: an input has this value instead of its reading, an output instead of its command. The force ends with the session that set it, when the device is disabled or lost, and at an emergency stop; an alarm is active until then. Returns the number of the force. */
  force: {
    role: "configure";
    arguments: {
      name: string;
      /** Value in the unit of the signal's channel. */
      value: Value;
      /** Person or session that forces the signal; set by the control interface to its caller. */
      who?: string | null;
    };
    result: number;
  };
  /** Ends the forcing of one signal, or of all. Returns the signals that were forced. */
  unforce: {
    role: "operate";
    arguments: {
      name?: string | null;
      /** Person or session that releases the signal; set by the control interface to its caller. */
      who?: string | null;
    };
    result: string[];
  };
  /** Returns the forced signals, by logical device. */
  forced: {
    role: "observe";
    arguments: Record<string, never>;
    result: { [name: string]: ForcedSignal };
  };
  /** Defines the text of an alarm code. */
  define_alarm: {
    role: "configure";
    arguments: {
      code: string;
    } & AlarmTextRequest;
    result: null;
  };
  /** Raises an alarm. */
  raise_alarm: {
    role: "operate";
    arguments: {
      code: string;
      /** Source of the alarm. */
      source?: string;
      text?: string;
    };
    result: null;
  };
  /** Clears the cause of an alarm. Returns true if the alarm was active. */
  clear_alarm: {
    role: "operate";
    arguments: {
      code: string;
      source?: string | null;
    };
    result: boolean;
  };
  /** Returns the current alarms, the shelved ones, and the history. */
  alarms: {
    role: "observe";
    arguments: Record<string, never>;
    result: Alarms;
  };
  /** Acknowledges one alarm, or all alarms that are not shelved. Returns the number of newly acknowledged alarms. */
  acknowledge_alarms: {
    role: "operate";
    arguments: {
      number?: number | null;
    };
    result: number;
  };
  /** Removes an alarm from the list for a limited time. Emergency stops, losses, and alarms of critical severity cannot be shelved. */
  shelve_alarm: {
    role: "operate";
    arguments: {
      number: number;
      /** Reason for the shelving. */
      reason: string;
      /** Duration on the system's clock; at most 24 h. */
      for_ns: number;
      /** Person or session that shelves the alarm; set by the control interface to its caller. */
      who?: string | null;
    };
    result: null;
  };
  /** Puts a shelved alarm back into the list. Returns true if it was shelved. */
  unshelve_alarm: {
    role: "operate";
    arguments: {
      number: number;
      /** Person or session that unshelves the alarm; set by the control interface to its caller. */
      who?: string | null;
    };
    result: boolean;
  };
  /** Restores the alarm history from an earlier run. */
  restore_alarms: {
    role: "configure";
    arguments: {
      history: AlarmRequest[];
    };
    result: null;
  };
  /** Returns the names of all items. */
  names: {
    role: "observe";
    arguments: Record<string, never>;
    result: Names;
  };
  /** Returns the processors, sources, devices as described by their drivers, and device types. */
  configuration: {
    role: "observe";
    arguments: Record<string, never>;
    result: Configuration;
  };
  /** Returns all instances with their blocks, ports, cells, command lists, conditions and transitions. */
  installed: {
    role: "observe";
    arguments: Record<string, never>;
    result: InstalledInstances;
  };
  /** Returns the defined verbs. */
  verbs: {
    role: "observe";
    arguments: Record<string, never>;
    result: VerbSummary[];
  };
  /** Returns the contents of a form for starting a verb: its arguments and input parameters. */
  verb_form: {
    role: "observe";
    arguments: {
      name: string;
    };
    result: VerbForm;
  };
  /** Returns the bodies, joints, shapes and meshes of a physical device, for drawing. */
  geometry: {
    role: "observe";
    arguments: {
      device: string;
    };
    result: Geometry;
  };
  /** Returns run-time data of sources, instances and devices. */
  statistics: {
    role: "observe";
    arguments: Record<string, never>;
    result: Statistics;
  };
  /** Starts a probe that measures the blocks of a source, or of all sources, one per firing; `statistics` then includes their durations. */
  probe: {
    role: "observe";
    arguments: {
      source?: string | null;
      /** Duration in real time, at most an hour. */
      for_ns: number;
    };
    result: null;
  };
  /** Returns the log: commands, conditions, faults, transitions and ends. */
  log: {
    role: "observe";
    arguments: {
      /** Number of the first entry. */
      since?: number;
    };
    result: LogEntry[];
  };
  /** Adds a workspace supplied by a program, replacing any supplied workspace with the same name. */
  ship_workspace: {
    role: "configure";
    arguments: WorkspaceRequest;
    result: null;
  };
  /** Removes a workspace supplied by a program. */
  withdraw_workspace: {
    role: "configure";
    arguments: {
      name: string;
    };
    result: null;
  };
  /** Saves a workspace for all users of the system. Cannot replace one supplied by a program. */
  keep_workspace: {
    role: "operate";
    arguments: WorkspaceRequest;
    result: null;
  };
  /** Removes a workspace saved by a person. */
  forget_workspace: {
    role: "operate";
    arguments: {
      name: string;
    };
    result: null;
  };
  /** Returns one-line summaries of the workspaces. */
  workspaces: {
    role: "observe";
    arguments: Record<string, never>;
    result: WorkspaceAbout[];
  };
  /** Returns the workspace with this name. */
  workspace: {
    role: "observe";
    arguments: {
      name: string;
    };
    result: Workspace;
  };
  /** Returns all mistakes of a workspace in the current system: those in its structure, and references to missing items. */
  check_workspace: {
    role: "observe";
    arguments: WorkspaceRequest;
    result: Refusal[];
  };
  /** Starts recording to a new MCAP file. Returns the number of the recording. */
  record: {
    role: "operate";
    arguments: {
      path: string;
      /** Names of SVVs, with * and ? as wildcards; all SVVs if omitted. */
      svvs?: string[] | null;
      /** True to include the private cells of all verb instances. */
      cells?: boolean;
      /** True to include all external inputs, so that the run can be replayed. */
      replay?: boolean;
      /**
       * Approximate file size, bytes, at which the next file is started: run.mcap, run-2.mcap and so on. A recording for replay
       * cannot be split.
       */
      split_bytes?: number | null;
      /** Number of files to keep if the recording is split (the oldest is deleted); all if omitted. */
      keep?: number | null;
      /** Identity of the recording, stored in the metadata of its files. Over the control interface, it is set by the daemon. */
      identity?: string | null;
      /**
       * True to continue after the existing files at that path; those with this identity then count towards `keep`. Over the
       * control interface, it is set by the daemon and must be omitted.
       */
      resumes?: boolean;
    };
    result: RecordingBegun;
  };
  /** Returns the state of a recording. */
  recording: {
    role: "observe";
    arguments: {
      recording: number;
    };
    result: RecordingSummary;
  };
  /** Ends a recording. Returns its state; if the recording has not ended yet, call again. */
  stop_recording: {
    role: "operate";
    arguments: {
      recording: number;
    };
    result: RecordingSummary;
  };
  /** Starts to replay a recording in a separate process, without affecting the system, and compares every value. Returns the number of the replay. Code modules in the recording run only if their SHA-256 digests match modules that the system has loaded at some time, or are in `trust`. */
  replay: {
    role: "configure";
    arguments: {
      path: string;
      /** Digests of code modules that may run. Over the control interface, they are set by the daemon and must be omitted. */
      trust?: string[];
      /**
       * True to replace modules of the recording with the system's current modules of the same names; the first difference is then
       * caused by them.
       */
      present?: boolean;
    };
    result: ReplayBegun;
  };
  /** Returns the state of a replay. */
  replaying: {
    role: "observe";
    arguments: {
      replay: number;
    };
    result: Replaying;
  };
  /** Stops a replay at its current position and deletes it. Returns its final state. */
  stop_replay: {
    role: "configure";
    arguments: {
      replay: number;
    };
    result: Replaying;
  };
  /** Returns the recordings in a folder, newest first. */
  recordings: {
    role: "observe";
    arguments: {
      /** Folder; over the control interface it is the daemon's own folder and must be omitted. */
      folder?: string;
    };
    result: RecordingFile[];
  };
  /** Returns a description of a recording: its time span, its contents and its ends. If the recording is still in progress, the description covers the part that is on disk. */
  recorded: {
    role: "observe";
    arguments: {
      path: string;
    };
    result: RecordingContents;
  };
  /** Returns the state of a recording at a given time. */
  recorded_at: {
    role: "observe";
    arguments: {
      path: string;
      /** Time on the system's clock. */
      time_ns: number;
      /** Names of SVVs and cells. */
      names?: string[];
      /** Names of other channels, such as `/installed`, `/statistics`, `/alarms`. */
      topics?: string[];
      /** Times of the messages that the caller already has, by channel; these messages are omitted. */
      known?: { [name: string]: number };
    };
    result: RecordedAt;
  };
  /** Returns messages of a channel that carries no values, such as `/log` or `/ends`. */
  recorded_messages: {
    role: "observe";
    arguments: {
      path: string;
      topic: string;
      /** Number of the first message. */
      since?: number;
    };
    result: RecordedMessages;
  };
  /** Returns SVVs and cells over a span of a recording, condensed into columns, with exact sums. */
  recorded_span: {
    role: "observe";
    arguments: {
      path: string;
      names: string[];
      from_ns: number;
      to_ns: number;
      /** Number of columns per channel, at most 10,000; the values within a column are condensed. */
      columns: number;
      /** `next` of the previous answer. */
      since?: number;
    };
    result: RecordedSpan;
  };
  /** Returns the time, in a recording, of the next (or previous) firing that stored a value; null if there is none. */
  recorded_firing: {
    role: "observe";
    arguments: {
      path: string;
      time_ns: number;
      /** True for the previous firing. */
      back?: boolean;
    };
    result: number | null;
  };
}

/** The calls that last, and go on in slices. */
export const LASTING: ReadonlySet<string> = new Set(["device_service", "scan_devices", "device_served", "wait_enabled", "disable", "perform", "performed", "wait", "halt", "advance", "pause", "paused"]);
