// SPDX-License-Identifier: Apache-2.0
// What the control interface takes and answers. Made by `npm run shapes` of crates/control/schemas/control-v1.json: not edited by hand.

/** One alarm. */
export interface Alarm {
  /** Counts the alarms of the system. */
  number: number;
  code: string;
  /** The verb, device or channel that it comes from. */
  source: string;
  /** The block that reported it, if one did. */
  block: string | null;
  text: string;
  remedy: string;
  severity: Severity;
  active: boolean;
  acknowledged: boolean;
  /** Number of times that it came. */
  count: number;
  /** When it came last, on the system's clock and on the wall (ns since 1970; under the virtual clock the system's own). */
  time_ns: number;
  wall_ns: number;
  returned_ns: number | null;
  acknowledged_ns: number | null;
  /** True if it can be shelved. An emergency stop, a loss and a critical alarm stay in the list; so does one of an earlier life. */
  shelvable: boolean;
  /** Shelvings of it, the latest last. */
  shelvings: Shelving[];
}

/** One alarm. */
export interface AlarmRequest {
  /** Counts the alarms of the system. */
  number: number;
  code: string;
  /** The verb, device or channel that it comes from. */
  source: string;
  /** The block that reported it, if one did. */
  block?: string | null;
  text: string;
  remedy: string;
  severity: Severity;
  active: boolean;
  acknowledged: boolean;
  /** Number of times that it came. */
  count: number;
  /** When it came last, on the system's clock and on the wall (ns since 1970; under the virtual clock the system's own). */
  time_ns: number;
  wall_ns: number;
  returned_ns?: number | null;
  acknowledged_ns?: number | null;
  /** True if it can be shelved. An emergency stop, a loss and a critical alarm stay in the list; so does one of an earlier life. */
  shelvable?: boolean;
  /** Shelvings of it, the latest last. */
  shelvings?: ShelvingRequest[];
}

/** Text of an alarm of one code. */
export interface AlarmText {
  text: string;
  remedy: string;
  severity: Severity;
}

/** Text of an alarm of one code. */
export interface AlarmTextRequest {
  text: string;
  remedy?: string;
  severity?: Severity;
}

/** The alarms of a system, as a call tells them. */
export interface Alarms {
  /** Alarms that are active or not acknowledged, newest last. */
  current: Alarm[];
  /** Alarms that an operator has taken out of that list for a time. */
  shelved: Alarm[];
  /** Alarms of the past, oldest first. */
  history: Alarm[];
  /** Text of each code. */
  texts: { [name: string]: AlarmText };
  /** Alarms that had to leave before they were over, because there was no place for another. */
  dropped: number;
}

/** A verb applied to arguments: what makes a verb instance. */
export interface Application {
  /** Name of a verb that was defined in the system. */
  verb: string;
  /** Instance name, or absent: `verb#n`. */
  name: string | null;
  arguments: { [name: string]: Argument };
  /** Pattern over flat block labels (`planner`, `pid.*`, `*`) → source (`rtp0.fast`); the first that fits counts. */
  placement: { [name: string]: string };
  /** Intervals changed at application: label → ns. */
  every: { [name: string]: number };
  /** Values of a start, where a check is to look at them too. */
  values?: { [name: string]: Value };
  /** The logical device whose own verb this is. */
  owner: string | null;
  place: SourceLocation | null;
}

/** A verb applied to arguments: what makes a verb instance. */
export interface ApplicationRequest {
  /** Name of a verb that was defined in the system. */
  verb: string;
  /** Instance name, or absent: `verb#n`. */
  name?: string | null;
  arguments?: { [name: string]: Argument };
  /** Pattern over flat block labels (`planner`, `pid.*`, `*`) → source (`rtp0.fast`); the first that fits counts. */
  placement?: { [name: string]: string };
  /** Intervals changed at application: label → ns. */
  every?: { [name: string]: number };
  /** Values of a start, where a check is to look at them too. */
  values?: { [name: string]: Value };
  /** The logical device whose own verb this is. */
  owner?: string | null;
  place?: SourceLocation | null;
}

/** Arbitration of a start that needs something of a logical device which another verb holds. */
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

/** Kind of a verb's argument. */
export type ArgumentKind = "device" | "group" | "svv" | "channel";

/** An arm: joints that move one tool. */
export interface ArmDescription {
  name: string;
  /** Logical devices of its joints, in the order of the chain. */
  joints: string[];
  /** Geometry that joins them; null where it is not known. */
  chain: ChainDescription | null;
  /** Reason why the geometry is not known, for people; empty where it is. */
  missing: string;
}

/** An arm: joints that move one tool. */
export interface ArmDescriptionRequest {
  name: string;
  /** Logical devices of its joints, in the order of the chain. */
  joints: string[];
  /** Geometry that joins them; null where it is not known. */
  chain?: ChainDescription | null;
  /** Reason why the geometry is not known, for people; empty where it is. */
  missing?: string;
}

/** `POST /v1/command/request`. */
export interface AskForCommand {
  /** Purpose, for the holder to read. */
  reason?: string;
  /** Time for which it waits for an answer, ms, 1,000 to 600,000. */
  wait_ms?: number;
}

/** A session that asks for command. */
export interface AskingSession {
  /** Counts the requests of the system. */
  number: number;
  /** The session that asks. */
  name: string;
  /** Its caller. */
  who: string;
  person: string | null;
  /** Purpose, for people. */
  reason: string;
  /** Time for which it still waits, ms. */
  left_ms: number;
}

/** A block of a verb instance. */
export interface BlockAbout {
  /** A block of a nested graph: `outer.inner.block`. */
  label: string;
  /** `module.block`. */
  block: string;
  /** The interrupt source that runs it, `rtp.source`. */
  source: string;
}

/** Block that begins again. */
export interface BlockAnew {
  /** Its label. */
  block: string;
  /** Reason for it. */
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

/** Durations of a block's invocations, as far as a probe has measured them. */
export interface BlockTimes {
  /** The verb instance. */
  instance: string;
  /** A block of a nested graph: `outer.inner.block`. */
  label: string;
  /** `module.block`. */
  block: string;
  /** Invocations that were measured. */
  samples: number;
  /** The last of them, ns. */
  last_ns: number;
  /** Their mean, ns. */
  mean_ns: number;
  /** The longest of them, ns. */
  max_ns: number;
  /** Number of the invocation that was measured last. */
  number: number;
}

/** One occurrence of a block in a graph or verb. */
export interface BlockUse {
  block: WrittenBlockSource;
  /** Constants for parameters, presets, sizes and inputs of this occurrence (`code.biquad(b0=0.1)`). */
  constants: { [name: string]: Value };
  place: SourceLocation | null;
}

/** One occurrence of a block in a graph or verb. */
export interface BlockUseRequest {
  block: WrittenBlockSourceRequest;
  /** Constants for parameters, presets, sizes and inputs of this occurrence (`code.biquad(b0=0.1)`). */
  constants?: { [name: string]: Value };
  place?: SourceLocation | null;
}

/** An end of the range of an input parameter. JSON: a number, `"arm.max_speed"` or `"-arm.max_speed"`. */
export type Bound = number | string;

/** A button that starts a verb, and halts it while it runs. */
export interface Button {
  label: string;
  /** Makes an instance of a verb and starts it with these values. Its name, where it has none, is `WORKSPACE.LABEL`. */
  start?: Application | null;
  /** The instance that is started instead: a program has made it. */
  instance?: string | null;
  /** Values of the start of that instance: input parameter to value. */
  values?: { [name: string]: Value };
}

/** A button that starts a verb, and halts it while it runs. */
export interface ButtonRequest {
  label: string;
  /** Makes an instance of a verb and starts it with these values. Its name, where it has none, is `WORKSPACE.LABEL`. */
  start?: ApplicationRequest | null;
  /** The instance that is started instead: a program has made it. */
  instance?: string | null;
  /** Values of the start of that instance: input parameter to value. */
  values?: { [name: string]: Value };
}

/** Kind of a data object. */
export type CellKind = "svv" | "private" | "constant" | "channel";

/** Geometry of an arm, as a value of the parameter `chain` of the kinematic blocks. Poses are x y z (m), then the quaternion w x y z. */
export interface ChainDescription {
  /** Number of joints. */
  joints: number;
  /** Of each of 16 joints: 0 does not move the tool, 1 turns, 2 slides. */
  kind: number[];
  /** Base of the arm in the frame in which poses are given. */
  base: number[];
  /** Flange in the frame of the base where every joint is at 0. */
  home: number[];
  /** Tool in the frame of the flange. */
  tool: number[];
  /** Unit vector along the axis of each of 16 joints, in the frame of the base, where every joint is at 0. */
  axis: number[][];
  /** Point on each of these axes, m. */
  anchor: number[][];
}

export interface Channel {
  /** `part.channel` or a plain name. */
  name: string;
  /** False: it is read; true: it is written. */
  write: boolean;
  type_text: string;
  unit: string;
}

/** Class of a refusal: the name of the Python exception class. */
export type Class = "TypeMismatch" | "UnitMismatch" | "NotEnabled" | "DeviceFailed" | "EmergencyStopped" | "CompositionConflict" | "DefinitionError" | "UnknownName" | "CoverError" | "SecondWriter" | "SchedulingError" | "SynchronousCycle" | "PlacementError" | "ValueRefused" | "OutOfRange" | "NotHomed" | "CallError" | "InvalidState" | "ModuleError" | "InUse" | "NotAllowed" | "NotCommanding" | "SessionLost" | "LimitExceeded" | "AuditFailed";

/** The clock of a system. */
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
  /** The interval may be changed while it runs. */
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
  /** The interval may be changed while it runs. */
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

/** A command list, or its commands alone. */
export type Commands = WrittenCommand[];

/** A command list, or its commands alone. */
export type CommandsRequest = WrittenCommandRequest[];

/** Definition of a composed verb. */
export interface Composition {
  name: string;
  doc?: string;
  /** Label → verb, in the order of the calls' parameters. */
  parts: { [name: string]: VerbRequest };
  transitions?: Step[];
  /** A part or list; absent: the first part. */
  initial?: string | null;
  /** `part.name` → the name that it has in the composed verb: of a parameter, object, output or condition. */
  rename?: { [name: string]: string };
  /** `part.input` → the value that it always has there. */
  preset?: { [name: string]: Value };
  /** Labels of blocks that are one instance in all parts that have them. */
  share?: string[];
  /** The initial lists of all parts are one list. */
  together?: boolean;
  /** End of parts that run together. */
  until?: TogetherUntil;
  place?: SourceLocation | null;
}

/** Configuration: processors, interrupt sources, physical devices, logical devices and their types. */
export interface Configuration {
  processors: { [name: string]: ProcessorAbout };
  /** Interrupt sources, `rtp.source`. */
  sources: { [name: string]: Source };
  /** Physical devices as their drivers describe them. */
  physical_devices: { [name: string]: PhysicalDevice };
  /** Device types of the logical devices. */
  logical_devices: { [name: string]: string };
  device_types: { [name: string]: DeviceType };
}

/** A part of a recording that cannot be read. */
export type DamagedPart = {
  /** Its place in the file: the first byte, and the first one behind it. */
  begins: number;
  ends: number;
  what: string;
  /** Times between which what is lost lies, ns on the system's clock, as far as the file says so. */
  from_ns: number | null;
  to_ns: number | null;
  /** Number of messages that are lost, by channel; empty where none is, nothing where the file does not say it. */
  lost: { [name: string]: number } | null;
};

/** `POST /v1/command/decline`. */
export interface DeclineRequest {
  /** The session that asks. */
  name: string;
  /** Reason, for people. */
  reason?: string;
}

export interface DeviceParameter {
  default: Value;
  unit: string;
  tunable: boolean;
  /** The values that it may have. */
  within?: Within | null;
  /** The PS keeps its value over a warm restart; absent: that of a tunable one. */
  keep?: boolean | null;
}

export interface DeviceParameterRequest {
  default: Value;
  unit?: string;
  tunable?: boolean;
  /** The values that it may have. */
  within?: Within | null;
  /** The PS keeps its value over a warm restart; absent: that of a tunable one. */
  keep?: boolean | null;
}

/** A joint of a machine. */
export interface DevicePart {
  name: string;
  [more: string]: unknown;
}

/** A logical device as it is asked for. */
export interface DeviceRequest {
  device_type: string;
  /** Parameters that differ from the type's. */
  parameters?: { [name: string]: Value };
  /** The verb that keeps it going, where that is another than its type's: its drive is commanded in another way. Members meet it alike. */
  verb?: string | null;
  /** Further arguments of its verb (`drive`). */
  arguments?: { [name: string]: Argument };
  /** Where its verb runs, `rtp.name`. */
  source?: string | null;
  /** Intervals of its verb's blocks that differ from the command list's, ns. */
  every?: { [name: string]: number };
  /** Parts of units that are others for this device than its type says, in order. */
  units?: [string, string][];
  /** Arbitration of a second verb that commands it, if it is not as its type says. */
  arbitration?: Arbitration | null;
  place?: SourceLocation | null;
}

/** State of a logical device. */
export type DeviceState = "disabled" | "enabling" | "standstill" | "moving" | "stopping" | "fault";

/** A logical device type: an optional verb, SVVs, parameters. */
export interface DeviceType {
  name: string;
  doc: string;
  /** Name of the verb that keeps the device going; members meet its parameters by name. */
  verb: string | null;
  svvs: { [name: string]: SvvSpecification };
  parameters: { [name: string]: DeviceParameter };
  arbitration: Arbitration;
  place: SourceLocation | null;
}

/** A logical device type: an optional verb, SVVs, parameters. */
export interface DeviceTypeRequest {
  name: string;
  doc?: string;
  /** Name of the verb that keeps the device going; members meet its parameters by name. */
  verb?: string | null;
  svvs?: { [name: string]: SvvSpecificationRequest };
  parameters?: { [name: string]: DeviceParameterRequest };
  arbitration?: Arbitration;
  place?: SourceLocation | null;
}

/** Drawing that is checked: one of the two. */
export interface Drawing {
  graph?: GraphRequest | null;
  verb?: VerbRequest | null;
}

/** A counter of a driver. */
export interface DriverCounter {
  name: string;
  /** Empty for a mere number. */
  unit: string;
  doc: string;
}

/** An option of a driver, or an argument of a service. */
export interface DriverOption {
  name: string;
  /** "text", "number", "whole", "bool", "list" or "table". */
  kind: string;
  /** Empty for none. */
  unit: string;
  /** Range of a number, or of each number of a list, `(0, 10]`: a round bracket excludes its end. Left out: every number. */
  range?: string | null;
  /** Default in words; null: it must be given. */
  default: string | null;
  doc: string;
}

/** The safe state of a device. */
export interface DriverSafeState {
  /** Description of the state. */
  doc: string;
  /** Agents that bring it about: "driver", "guard", "device". */
  by: string[];
  /** Time from the request until it holds, ns. */
  within_ns: number;
}

/** A service of a driver: a command off the cycle. */
export interface DriverService {
  name: string;
  doc: string;
  arguments: DriverOption[];
  /** The kind of its answer; null: it answers nothing. */
  answer: string | null;
  /** True if it moves the device: it is refused while an emergency stop is latched. */
  moves: boolean;
}

/** Reason for which an active block is due: its interval or trigger, the blocks that drive it, or values from other sources and instances. */
export type DueBy = "interval" | "driven" | "queued";

/** One end of one start. */
export interface End {
  /** Counted from 0 over the life of the system. */
  number: number;
  instance: number;
  report: Report;
}

/** An argument that an instance is made with. */
export interface FormArgument {
  name: string;
  kind: ArgumentKind;
  /** Type of a device or a group. */
  of: string | null;
  /** Type of an SVV or channel; empty if the argument has several. */
  type_text: string;
  unit: string;
  doc: string;
  /** Channels of a part that are used. */
  members: string[];
}

/** A value that a start is given. */
export interface FormInput {
  name: string;
  type_text: string;
  unit: string;
  doc: string;
  default: Value | null;
  /** A number, or a parameter of an object, `arm.max_speed`, before which a minus may stand. */
  minimum: Bound | null;
  maximum: Bound | null;
  /** The SVV of an object that the range is counted from. */
  counted_from: string | null;
  /** True if it has no default. */
  required: boolean;
  /** True if it may be changed while the verb runs. */
  tunable: boolean;
}

/** Groups of fused blocks, and blocks that are not fused. */
export interface FusedBlocks {
  /** Tables get the entries that there are, also those of instances that come. */
  on: boolean;
  /** Groups that nobody has compiled so far: `fuse` goes on with them. */
  waiting: number;
  /** Groups of blocks, by their sources. */
  groups: FusedGroup[];
  /** Blocks that cannot be fused. */
  single: SingleBlock[];
}

/** Blocks that stand behind each other and are always due together, of which some read what others store. */
export interface FusedGroup {
  /** The interrupt source that fires them. */
  source: string;
  /** `instance.label`, in the order in which they run. */
  blocks: string[];
  /** True if they run by one entry. */
  fused: boolean;
  /** Reason why they have none. */
  why: string | null;
}

/** Bodies of a machine for drawing. Metres; quaternions w x y z; places are those on the parent. */
export interface Geometry {
  /** Bodies in the order of the model; the first is the world. */
  bodies: GeometryBody[];
  meshes: GeometryMesh[];
  /** The name by which contacts are read, six numbers each: place, m, and force, N, in the world; null: none are told. */
  contacts: string | null;
}

/** A body: where it is on its parent, how it moves, its shapes. */
export interface GeometryBody {
  name: string;
  /** Null of the world. */
  parent: string | null;
  position: [number, number, number];
  /** w x y z. */
  quaternion: [number, number, number, number];
  /** The first of its joints. */
  joint: GeometryJoint | null;
  joints: GeometryJoint[];
  geoms: GeometryGeom[];
}

/** A shape of a body. */
export interface GeometryGeom {
  /** `plane`, `hfield`, `sphere`, `capsule`, `ellipsoid`, `cylinder`, `box`, `mesh`, `sdf`. */
  kind: string;
  /** Size as MuJoCo counts it: half lengths, radii. */
  size: [number, number, number];
  position: [number, number, number];
  /** w x y z. */
  quaternion: [number, number, number, number];
  /** Red, green, blue, opacity, 0 to 1. */
  rgba: [number, number, number, number];
  /** Index into the meshes; null: it is drawn as its kind says. */
  mesh: number | null;
}

/** A joint of a body. */
export interface GeometryJoint {
  name: string;
  kind: JointKind;
  axis: [number, number, number];
  position: [number, number, number];
  /** Position of a hinge or slide as the model is drawn, rad or m. A page turns by position - reference. */
  reference: number | null;
  /** The name by which its position is read; null: no channel tells it. */
  svv: string | null;
}

/** Triangles. */
export interface GeometryMesh {
  /** Three numbers a vertex. */
  vertices: number[];
  /** Three vertices a face. */
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
  /** `divide={"estimator": 5}`: this block at 5 T where the graph is activated at T. */
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
  /** `divide={"estimator": 5}`: this block at 5 T where the graph is activated at T. */
  divide?: { [name: string]: number };
  place?: SourceLocation | null;
}

/** `POST /v1/command/hand_over`. */
export interface HandOver {
  /** Session that takes command. */
  to: string;
}

/** Holder of command, those who ask for it, and the outcomes of the last requests. */
export interface Holder {
  /** Name of the session that commands; null: none does. */
  holder: string | null;
  /** Its caller: a user, a token or a certificate. */
  who: string | null;
  /** Name of its person, if it was given. */
  person: string | null;
  /** Requests for command that wait, oldest first. */
  requests: AskingSession[];
  /** The last requests that have ended, oldest first. */
  settled: SettledRequest[];
}

/**
 * `set`, a bool input or parameter, becomes true; when the condition `until` comes, the verb stops. Going on clears `set`. It
 * counts in the command lists in which the block of `until` is active.
 */
export interface Holding {
  set: string;
  until: string;
}

/** Action of a running verb instance when the programming system that started it dies or can no longer be reached. */
export type IfCutOff = "continue" | "halt" | "safe";

/** Process of a processor, as a call names it. */
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
  /** Its default is its value at every start; no call gives another (`preset=` of a composition). */
  preset: boolean;
  unit: string;
  /** Minimum and maximum value, checked before a start. */
  within: [Bound, Bound] | null;
  /** The range is that of this SVV of an object plus the value (`arm.commanded`, for a relative goal). */
  counted_from: string | null;
  /** Where a call leaves it out: this attribute of an object, `arm.chain`, which the PS looks up. */
  member?: string | null;
  /** The function of the PS that makes the value of what people write, by its name. */
  form?: string | null;
  place: SourceLocation | null;
}

/** An input parameter: ψ. */
export interface InputParameterRequest {
  targets: NameList;
  default?: Value | null;
  tunable?: boolean;
  /** Its default is its value at every start; no call gives another (`preset=` of a composition). */
  preset?: boolean;
  unit?: string;
  /** Minimum and maximum value, checked before a start. */
  within?: [Bound, Bound] | null;
  /** The range is that of this SVV of an object plus the value (`arm.commanded`, for a relative goal). */
  counted_from?: string | null;
  /** Where a call leaves it out: this attribute of an object, `arm.chain`, which the PS looks up. */
  member?: string | null;
  /** The function of the PS that makes the value of what people write, by its name. */
  form?: string | null;
  place?: SourceLocation | null;
}

/** Activation of a block, and when it is due. */
export interface InstalledActivation {
  /** True while it is active. */
  on: boolean;
  due: DueBy;
  /** Labels of the blocks that drive it. */
  by: string[];
  /** Its rate in each command list in which it is active. */
  rates: { [name: string]: Rate };
  /** Time that one invocation may take, ns. */
  budget_ns: number | null;
  /** Its interval may be changed while it runs. */
  tunable: boolean;
}

/** A function block instance. */
export interface InstalledBlock {
  /** A block of a nested graph: `outer.inner.block`. */
  label: string;
  /** `module.block`. */
  block: string;
  doc: string;
  /** The interrupt source that runs it, `rtp.source`. */
  source: string;
  /** Number of elements of its sized ports. */
  size: number | null;
  /** The file that it was written in; empty: not known. */
  file: string;
  /** The interval while it is active, else that of the first list in which it is, ns; null where no timer says. */
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
  /** Label and port of what writes it. */
  writers: [string, string][];
  /** Label and port of what reads it. */
  readers: [string, string][];
  /** Value of a constant. */
  value?: Value | null;
}

/** A termination condition. */
export interface InstalledCondition {
  name: string;
  /** The block conditions that it stands for, `label.condition`. */
  of: string[];
  /** True if it is one of every verb: `halted`, `time_limit`. */
  system: boolean;
  /** Output values that it returns. */
  returns: string[];
  /** Its end is an exception. */
  raises: boolean;
  /** The command lists in which it counts; empty: all. */
  during: string[];
  priority: number;
  /** Code of the alarm that it raises. */
  alarm: string | null;
}

/** A verb instance with its blocks, cells, command lists, conditions and transitions. */
export interface InstalledInstance {
  id: number;
  name: string;
  verb: string;
  state: InstanceState;
  /** The command list that runs, or ran last. */
  list: string;
  /** Number of the wait in its list at which it is. */
  stage: number;
  /** The logical device whose own verb it is. */
  owner: string | null;
  /** Number of its starts. */
  starts: number;
  /** Its owner, or the first of the logical devices that it acts on. */
  device: string | null;
  /** The logical devices that it acts on. */
  devices: string[];
  /**
   * The present values of its input parameters: those of its latest start with what was changed since; before the first one the
   * defaults. Null: it has none yet.
   */
  inputs: { [name: string]: Value | null };
  blocks: InstalledBlock[];
  cells: InstalledCell[];
  lists: InstalledList[];
  conditions: InstalledCondition[];
  transitions: InstalledTransition[];
  /** The list that a start begins with. */
  initial: string;
  /** The list that runs at its end. */
  ending: string | null;
}

/** Installed verb instances. */
export interface InstalledInstances {
  instances: InstalledInstance[];
}

/** A command list. */
export interface InstalledList {
  name: string;
  /** Commands as a program would write them, for people to read. */
  commands: string[];
}

/** A port, parameter, condition or device item of a block, and what it is bound to. */
export interface InstalledPort {
  name: string;
  direction: PortDirection;
  /** The block writes it. */
  writes: boolean;
  type_text: string;
  unit: string;
  /** The mode in force: `synchronous`, `ratio 5`, `asynchronous`. */
  mode: string;
  doc: string;
  /** The SVV, private cell, channel or constant that it is bound to: what `read`, `svv_about` and the stream call it. */
  cell: string | null;
  /** An input without a default. */
  required: boolean;
  /** Cells of an array port that is bound to one cell for each element. */
  cells?: string[] | null;
  /** Value of a parameter, and of an input that nothing is bound to: the one that it was made with. */
  value?: PortValue | null;
}

/** A transition: on this condition the list `to` follows the list `from`. */
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
  /** Names of its command lists. */
  lists: string[];
  /** The command list that runs, or ran last. */
  list: string;
  /** Names of its termination conditions, those of every verb too. */
  conditions: string[];
  /**
   * The present values of its input parameters: those of its latest start with what was changed since; before the first one the
   * defaults. Null: it has none yet.
   */
  inputs: { [name: string]: Value | null };
  /** Names of its output values. */
  outputs: string[];
  /** The logical device whose own verb it is. */
  owner: string | null;
  /** Number of its starts. */
  starts: number;
  /** Time for which it has run since its start, without the time that it was suspended, s. */
  running_s: number;
  /** Arguments that were filled in when it was made, and other remarks. */
  remarks: string[];
}

/** State of a verb instance: created → (queued →) running ⇄ suspended → ended (→ running again by `start`) → deleted. */
export type InstanceState = "created" | "running" | "suspended" | "ended" | "queued" | "deleted";

/** A verb instance, in one line. */
export interface InstanceStatistics {
  id: number;
  name: string;
  verb: string;
  state: InstanceState;
  /** The command list that runs, or ran last. */
  list: string;
  /** The logical device whose own verb it is. */
  owner: string | null;
  /** Time for which it has run since its start, without the time that it was suspended, s. */
  running_s: number;
}

/** Interface of a block. */
export interface Interface {
  /** `module.block`. */
  name: string;
  doc: string;
  items: Item[];
  /** Named struct types that items use: name → declaration (`struct { double x; double[4] q; }`). */
  types: { [name: string]: string };
  file: string;
  line: number;
}

/** One item of an interface; its index in [`Interface::items`] is its index in the descriptor. */
export interface Item {
  name: string;
  kind: ItemKind;
  mode: PortMode;
  /** C type as declared; empty for a condition without a value. */
  type_text: string;
  unit: string;
  /** Items whose units make its own: declared as `=u`, the unit of u, or `=k.u`, that of their product. `unit` is empty then. */
  unit_of?: string[];
  /**
   * The numbers that it may be, of an array each element: declared behind the unit, `rad/s (0, 10]`. If it is absent, any finite number is
   * allowed.
   */
  range?: Range | null;
  doc: string;
  /** An input that may stay unbound. */
  has_default: boolean;
  nonfinite: boolean;
  /** Number of elements is the block's size. */
  sized: boolean;
  /**
   * Number of last values that an input reads, oldest first; 0 if it reads the present one. `type_text` is that of
   * one value.
   */
  history: number;
  /** Default of a parameter, preset, defaulted input, in bytes of the type (from the descriptor's image); size: unused. */
  default: number[];
  /** Size item: minimum and maximum n. */
  least: number;
  most: number;
}

export type ItemKind = "input" | "output" | "device_read" | "device_write" | "condition" | "parameter" | "state" | "size";

/** Kind of a joint's motion. */
export type JointKind = "free" | "ball" | "slide" | "hinge";

/** An end report that waits for its session. */
export interface KeptReport {
  /** Counts the ends of the system. */
  number: number;
  /** The verb instance. */
  instance: number;
  report: Report;
}

/** The end reports that wait for a session. */
export interface KeptReports {
  /** Oldest first. */
  reports: KeptReport[];
  /** Number of reports that are gone, because too many waited. */
  lost: number;
}

/** Kind of an interrupt source. */
export type KindOfSource = "timer" | "trigger" | "software";

/** Limits of one start. */
export interface Limits {
  /** Running time after which `time_limit` comes, ns. */
  time_limit_ns?: number | null;
  /** Overruns of its sources after which `overrun` comes. */
  overruns?: number | null;
  /**
   * Age of a value from another source beyond which `late` (of a ratio input) or `link_lost` (of what a timer publishes in each
   * firing) comes, ns.
   */
  age_max_ns?: number | null;
}

export interface LogEntry {
  sequence: number;
  time_s: number;
  /** `start`, `admission`, `exchange`, `end`, `condition`, `transition`, `ending`, `fault`, `overrun`, `late`, `device`, `processor_lost`, `emergency_stop`, `lost`, `journal`, `control`, `recorder`, `module`, `command`. */
  kind: string;
  /** The verb instance, device or source it is about. */
  about: string;
  text: string;
  /**
   * Caller of a command: `program`, the program that this system is part of, or a session or caller of the control interface;
   * else empty.
   */
  who: string;
}

/** Mode of operation: it limits what may be started. */
export type Mode = "automatic" | "manual";

/** A code module: its blocks and struct types. */
export type ModuleAbout = {
  name: string;
  blocks: Interface[];
  /** Declarations of its struct types by name. */
  types: { [name: string]: string } | null;
  /** Remark about the module. */
  note?: string | null;
};

/** One name or several, as JSON may have them. */
export type NameList = string | string[];

/** A work frame, or a tool in the frame of the flange. */
export interface NamedFrame {
  name: string;
  /** m */
  position: [number, number, number];
  /** Roll, pitch and yaw, degrees. */
  rpy_deg: [number, number, number];
}

/** The names of what there is. */
export interface Names {
  processors: string[];
  /** Processors by the process that they run in, of those that do not run in the supervisor's. */
  processes: { [name: string]: string[] };
  /** The processor that the supervisor runs on. */
  supervisor: string | null;
  /** Interrupt sources, `rtp.source`. */
  sources: string[];
  /** Physical devices. */
  devices: string[];
  svvs: string[];
  logical_devices: string[];
  verbs: string[];
  device_types: string[];
  /** Code modules that were downloaded. */
  modules: string[];
  /** Function blocks, `module.block`. */
  blocks: string[];
  /** Verb instances. */
  instances: string[];
}

/** An object of a verb: one logical device, or (`each`) several of the type. */
export interface Object {
  device_type: string;
  each: boolean;
}

/** An object of a verb: one logical device, or (`each`) several of the type. */
export interface ObjectRequest {
  device_type: string;
  each?: boolean;
}

/** `POST /v1/sessions`. */
export interface OpenSession {
  /** The caller's own: letters, digits, `.`, `_` and `-`, at most 64. */
  name: string;
  /** Time without a sign of life after which it counts as lost, ms, 1,000 to 60,000. */
  lost_after_ms?: number;
  /** Takes up a session of that name that is alive, as the same caller. */
  take_up?: boolean;
  /** Name of the person, for others to see; at most 64 characters. Left out: as before, if the session was there before. */
  person?: string | null;
}

/** Another condition that came in the firing that ended the verb, or while it was moving. */
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
  /** Name of the verb that it was made from. */
  verb: string;
  /** The command list of the composed verb with which it begins. */
  initial: string;
}

/** A command list that a condition led on from. */
export interface PassedList {
  command_list: string;
  condition: string;
  /** The block that reported it, if one did. */
  block: string | null;
  time_s: number;
}

/** Pauses in force: true: all actions; false: none; a list: the actions on these logical devices. */
export type PausesInForce = boolean | string[];

/** A physical device as its driver describes it. */
export interface PhysicalDevice {
  /** The interrupt source that reads and writes it; absent in the answer of the call that makes it. */
  source?: string | null;
  channels: Channel[];
  /** The joints of its machine, for which logical devices can be made. */
  parts?: DevicePart[] | null;
  /** Time without a command after which it goes to its safe state, ns. */
  watchdog_ns?: number | null;
  /** True if it goes on under its last commands when the process of its driver is gone or hangs: it has no watchdog, and no guard can reach it. */
  unguarded?: boolean;
  /** The same in words, with the remedy; absent where something makes it safe. */
  unguarded_why?: string | null;
  /** Where its driver exchanges: "inline", "worker" or "process". */
  class?: string | null;
  /** Agents that bring its outputs to their safe state, and the time that they take. */
  safe_state?: DriverSafeState | null;
  /** Services of its driver, off the cycle. */
  services?: DriverService[];
  /** Counters of its driver. */
  counters?: DriverCounter[];
  [more: string]: unknown;
}

/** Statistics of a physical device. */
export interface PhysicalDeviceStatistics {
  /** Cause of its loss; null: it is not lost. */
  lost: string | null;
  /** Number of commands that were held back by the limit of their slope. */
  slew_limited: number;
  /** Counters of its driver, by name. */
  counters: { [name: string]: number };
}

/** A verb with its arguments, ready to be installed. */
export interface Plan {
  verb: string;
  blocks: PlannedBlock[];
  cells: PlannedCell[];
  activations: PlannedActivation[];
  /**
   * Blocks of each source in the order of a firing: synchronous edges, then asynchronous ones where that makes no cycle,
   * then declaration order. (`rtp.name`, blocks).
   */
  order: [string, number[]][];
  lists: PlannedList[];
  /** Index of the initial list. */
  initial: number;
  ending: PlannedEnding;
  suspend: PlannedSuspend;
  /** Action when the programming system that started it is cut off, if its verb declares one. */
  if_cut_off: IfCutOff | null;
  conditions: PlannedCondition[];
  inputs: PlannedInput[];
  requirements: PlannedRequirement[];
  outputs: PlannedOutput[];
  claims: PlannedClaim[];
  /** Arbitration with another instance that holds it, claim by claim: as the logical device that it belongs to declares. */
  arbitration: Arbitration[];
  /** Logical devices that must be enabled. */
  devices: string[];
  /** True if it may be started in manual mode. */
  manual: boolean;
  remarks: Remark[];
}

/**
 * Blocks of one source that are always active together at one rate: the largest such sets, so that a chain that is
 * activated as one runs as one.
 */
export interface PlannedActivation {
  source: string;
  due: PlannedDue;
  blocks: number[];
  budget_ns: number | null;
  /** Its interval may be changed while it runs. */
  tunable: boolean;
  /** Rate in each command list in which it is on (list index, rate), for the relations of later instances. */
  rates: [number, Rate][];
}

/** Binding of a port or device item. */
export type PlannedBinding = {
  Cell: number;
} | {
  Cells: number[];
};

/** One subroutine instance. */
export interface PlannedBlock {
  /** Flat label: `servo.pid`. */
  label: string;
  /** `module.block`. */
  block: string;
  /** `rtp.name`. */
  source: string;
  /** n of a sized block. */
  size: number | null;
  /** Values of parameters, presets and sizes that differ from the block's defaults: item → bytes. */
  values: [number, number[]][];
  bindings: PlannedPort[];
  /** Blocks of this plan in the same source whose outputs it takes synchronously. */
  drivers: number[];
  /** SVVs that it takes synchronously (or by ratio) from writers outside this plan: (item, SVV name). */
  external_drivers: [number, string][];
  /** Blocks of this plan in other sources whose outputs it takes synchronously. */
  remote_drivers: number[];
  /** The activation it belongs to (every block has one; of a block that is only executed it is never on). */
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

/** One data object of the instance. */
export interface PlannedCell {
  kind: PlannedCellKind;
  /** Normalised type. */
  type_text: string;
  size: number;
  align: number;
  unit: string;
  /** First value at each start (private, constant), in bytes. */
  initial: number[];
  /** The blocks and items of this plan that write and read it. */
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

/** A command, resolved. */
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

/** A termination condition, resolved. The eight system conditions are there after those of the verb, if the verb does not name them. */
export interface PlannedCondition {
  name: string;
  /** (block, item) of the block conditions that it stands for; empty for a system condition. */
  on: [number, number][];
  /** ν: indices into `outputs`. */
  returns: number[];
  /** Its end is normal: no exception (`completed`; `returns` and no `raises`). */
  normal: boolean;
  priority: number;
  /** Lists to which it is limited; empty: all. Conditions of one name have no list in common. */
  during: number[];
  /** Code of the alarm that it raises. */
  alarm: string | null;
}

/** Reason for which an activation is due, while it is on. */
export type PlannedDue = "Interval" | {
  Driven: {
    by: [number, number][];
  };
} | {
  Queued: {
    by: [number, number][];
  };
};

/** Course of an end, resolved. */
export interface PlannedEnding {
  /** Index of the list that runs at the end. */
  list: number | null;
  /** Running time that it may take. */
  limit_ns: number;
}

/** Port that becomes true, and the condition (block, item) that is waited for if its block is active. */
export interface PlannedHolding {
  set: PlannedTarget;
  until: [number, number];
}

/** An input parameter: ψ, resolved. */
export interface PlannedInput {
  name: string;
  origin: PlannedOrigin;
  /** Normalised type, and the declarations it needs are resolved in it. */
  type_text: string;
  unit: string;
  default: Value | null;
  tunable: boolean;
  range: PlannedRange | null;
  /** The ranges of the items that it goes to. */
  item_ranges: Range[];
  targets: PlannedTarget[];
}

export interface PlannedList {
  name: string;
  stages: PlannedStage[];
  /** τ(this, condition) = list: indices. */
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

/** Relation of an input to its writer, after relaxing. */
export interface PlannedPort {
  item: number;
  binding: PlannedBinding;
  /** Mode in force. */
  mode: PortMode;
  /** Number of values that a history input reads; else 0. */
  history: number;
}

/** The range of an input parameter, resolved. */
export interface PlannedRange {
  least: PlannedBound;
  most: PlannedBound;
  /** SVVs that the value is counted from, one for each device. */
  counted_from: string[];
}

/** Property that one device must have at a start. */
export interface PlannedRequirement {
  device: string;
  member: PlannedMember;
  /** Member that must be true for it to hold. */
  when: PlannedMember | null;
  raises: Class;
  remedy: string;
}

/** Section of a command list up to a wait. */
export interface PlannedStage {
  commands: PlannedCommand[];
  /** `None`: the list is through; the process goes on until a condition comes or nothing is active. */
  wait: PlannedWait | null;
  /** Activations that are on after the commands of this stage: (activation, every). */
  active: [number, number][];
}

/** Suspension of the instance, resolved. */
export type PlannedSuspend = "Idle" | "Hold" | "HoldLast" | "Safe" | {
  Holding: PlannedHolding[];
};

/** A place that a value is stored in or read from. */
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

/** A port as who draws it knows it: of a block, or, `block` empty, of the graph itself. */
export interface PortName {
  block: string;
  port: string;
}

/** The value of a port that nothing is bound to, or the number of elements of a block; null where it has none. */
export type PortValue = Value | number | null;

/** Reason why two ports cannot be wired; of one port and all others, a list. */
export type PortVerdicts = string | null | Verdict[];

/** Result for one processor in a process of its own, or for those that share one. */
export interface ProcessTakenOver {
  /** Its name; of a process that may be shared, that of the process. */
  name: string;
  /** The processors in that process. */
  processors: string[];
  /** True if something of it ran, and has been taken over now; else its process was started for this system. */
  is_adopted: boolean;
  /** Blocks that go on where they were, by label. */
  carried: string[];
  /** Blocks that begin again, with the reason. */
  anew: BlockAnew[];
  /** Blocks that ran, and that this system has not started: they have ended. */
  ended: string[];
  /** The longest time for which a device was not written, ns; none where there is none. */
  gap_ns: number | null;
}

/** A real-time processor. */
export interface ProcessorAbout {
  /** The core that it is bound to. */
  core: number | null;
  /** The supervisor runs on it. */
  supervisor: boolean;
  /** The process that it runs in; null: the supervisor's. */
  process: string | null;
  /** The host that it runs on; null: the supervisor's. */
  host: string | null;
}

/** Mark of a condition that raises: a bool, or the name of the class, which the programming system knows. */
export type RaiseMark = boolean | string;

/** The values that an item may have. As text `[0, 1]`, `(0, inf)`, `[pose]`: a round bracket excludes its end. */
export type Range = string;

/** Rate at which a writer updates, in one command list. */
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
  /** The value, where bytes are not asked for. */
  value?: Value | null;
  /** The memory of its C type in base64, little endian, where that is asked for. */
  bytes?: string | null;
  number: number;
  time_ns: number;
}

/** State at a time of a recording. */
export interface RecordedAt {
  /** Values that were stored last; null: there was none yet. */
  values: { [name: string]: Reading | null };
  /** Messages of other channels that came last, with their times; null: there was none yet. What is known is left out. */
  messages: { [name: string]: RecordedMessage | null };
}

/** An SVV or private cell of a recording. */
export interface RecordedChannel {
  /** Name `INSTANCE:CELL` of a cell. */
  name: string;
  /** `svv` or `cell`. */
  kind: string;
  type_text: string;
  unit: string;
  /** Numbers that one value has. */
  components: number;
}

/** An end of a verb instance. */
export interface RecordedEnd {
  instance: string;
  /** The condition that ended it. */
  condition: string;
  time_s: number;
}

/** A message of a channel that has no values. */
export interface RecordedMessage {
  /** Time on the system's clock. */
  time_ns: number;
  message: unknown;
}

/** Messages of a channel in their order. */
export interface RecordedMessages {
  messages: RecordedMessage[];
  /** The number of the next one, where there may be more: to be asked for with `since`. */
  next: number | null;
}

/** Some channels over a span. */
export interface RecordedSpan {
  channels: RecordedTrace[];
  /** Where this is not all, `since` of the call that goes on: what that returns follows what is here, and its sums are more. */
  next: number | null;
}

/** Digest of one number of a channel over a span; every finite value counts once. */
export interface RecordedSums {
  count: number;
  /** 0 where there is no value. */
  min: number;
  max: number;
  sum: number;
  /** The sum of squares. */
  squares: number;
  /** The sum of the squared differences from the mean: not lost among large values, as the sum of squares less that of the mean is. */
  spread: number;
}

/** One channel over a span. */
export interface RecordedTrace {
  /**
   * Value stored last before the span; of each column the first value, the last, and of each number the minimum and the maximum,
   * whole values with their own times. In base64, little endian: (i64 time in ns, u64 number) of all, then the numbers as f64.
   */
  samples: string;
  /** Sums of each number, over all values of the span. */
  sums: RecordedSums[];
}

/** A recording that has begun. */
export interface RecordingBegun {
  /** Its number. */
  recording: number;
}

/** A recording. */
export interface RecordingContents {
  /** Name of the system. */
  system: string;
  /** Version of OpenGPAC that wrote it. */
  version: string;
  /** `virtual` or `monotonic`. */
  clock: string;
  /** Time at which the clock of the system stood at 0, s since 1970. */
  epoch_unix_s: number;
  /** First and last time in it, ns on the system's clock. */
  begins_ns: number;
  ends_ns: number;
  /** False where the file has no end: it is under way, or its recorder was killed, or the disk was full. */
  complete: boolean;
  /** True if it can be run again: `opengpac replay`. */
  replay: boolean;
  channels: RecordedChannel[];
  /** Topics of other channels: `/log`, `/ends`, … */
  topics: string[];
  /** Verbs that were installed, in the order of their names; of a long recording those of its beginning. */
  verbs: string[];
  /** Ends of verb instances; of a long recording the first ones. */
  ends: RecordedEnd[];
  /** Messages that are not in it, by channel, where there are any. */
  lost: { [name: string]: number };
  /** Parts of the file that cannot be read, as far as they are known: the content of a chunk is checked when it is read first. */
  damage: DamagedPart[];
  /** Description of the system in the file: `configuration` is the answer of the call of that name as JSON. */
  metadata: { [name: string]: string };
}

/** A file in a folder of recordings. */
export interface RecordingFile {
  /** Its plain name. */
  name: string;
  /** Its size in bytes. */
  bytes: number;
  /** Time at which it was written last, s since 1970. */
  written_unix_s: number;
}

/** State of a recording, or its end. */
export interface RecordingSummary {
  /** The file; of a recording that is split the first one. */
  path: string;
  /** The files that are there, the oldest first; the last one is written. */
  files: string[];
  running: boolean;
  /** Messages that were written, by channel; while it runs, in whole chunks. */
  counts: { [name: string]: number };
  /** Messages that could not be written, by channel, where there are any. */
  lost: { [name: string]: number };
  /** Bytes of the files that are there. */
  bytes: number;
  /** Bytes that were free on their disk when it was written to last, where that is known. */
  free_bytes: number | null;
  /** Failure that ended the recording, if one did. */
  failure: string | null;
}

/** One thing that is wrong. */
export interface Refusal {
  class: Class;
  /** Lower case, both ends named: `cannot bind output 'a.y' (double, N.m) to input 'b.u' (float): types differ`. */
  message: string;
  ends?: RefusalEnd[];
  /** The next step if it is known; printed after the message, behind a semicolon. */
  remedy?: string;
  /** Place to look at first: the definition that is at fault. */
  place?: SourceLocation | null;
  /** The parts of the definition that it is about, the first one first. */
  where?: Where[];
}

/** One of the ends that a refusal is about. */
export interface RefusalEnd {
  /** Name in the message, for example `output 'servo.effort' (double, N.m)`. */
  what: string;
  place?: SourceLocation | null;
}

/** A part of a layout: a row or a column of regions, tabs, or one panel. */
export interface Region {
  /** Its share of the row or column, relative to its neighbours'; 1 where it is left out. */
  share?: number | null;
  /** Regions side by side. */
  row?: Region[];
  /** Regions one above the other. */
  column?: Region[];
  /** Panels in one place, of which one is seen. */
  tabs?: Region[];
  /** Content of the panel. */
  panel?: PanelKind | null;
  /** Heading of the panel; what it shows, where it is empty. */
  title?: string;
  /** SVVs and private cells of a plot, each at its full rate. */
  names?: string[];
  /** Time that a plot looks back, s, 0.1 to 600; 10 by default. */
  seconds?: number | null;
  /** Rows of a table of values. */
  values?: ShownValue[];
  /** Physical device that a scene draws. */
  device?: string | null;
  /** Verb of a state diagram. */
  verb?: string | null;
  /** Actions that buttons start, one each. */
  buttons?: Button[];
}

/** A part of a layout: a row or a column of regions, tabs, or one panel. */
export interface RegionRequest {
  /** Its share of the row or column, relative to its neighbours'; 1 where it is left out. */
  share?: number | null;
  /** Regions side by side. */
  row?: RegionRequest[];
  /** Regions one above the other. */
  column?: RegionRequest[];
  /** Panels in one place, of which one is seen. */
  tabs?: RegionRequest[];
  /** Content of the panel. */
  panel?: PanelKind | null;
  /** Heading of the panel; what it shows, where it is empty. */
  title?: string;
  /** SVVs and private cells of a plot, each at its full rate. */
  names?: string[];
  /** Time that a plot looks back, s, 0.1 to 600; 10 by default. */
  seconds?: number | null;
  /** Rows of a table of values. */
  values?: ShownValue[];
  /** Physical device that a scene draws. */
  device?: string | null;
  /** Verb of a state diagram. */
  verb?: string | null;
  /** Actions that buttons start, one each. */
  buttons?: ButtonRequest[];
}

/** Remark about something that was filled in or is worth knowing: an implied cell, an edge that is a delay. */
export interface Remark {
  text: string;
  place: SourceLocation | null;
}

/** A replay that has begun. */
export interface ReplayBegun {
  /** Its number. */
  replay: number;
}

/** A difference, for people. */
export interface ReplayDifference {
  /** Source. */
  source: string;
  /** Number of the firing. */
  number: number;
  /** Its release, ns. */
  time_ns: number;
  /** True if it came between two firings. */
  between: boolean;
  /** Label of the block, with its instance; empty where it is not known. */
  block: string;
  /** Port; empty where it is not known. */
  port: string;
  /** The SVV in which it is stored; empty of a private cell, and where it is not known. */
  svv: string;
  /** Type of the port. */
  type_text: string;
  /** The elements of the recorded value; hexadecimal digits of what has no numbers. */
  recorded: string[];
  /** The same of the value now. */
  replayed: string[];
  /** Difference in the way that the source went, where there is one. */
  how: string;
  /** SVVs that blocks of the source store, with their values now, where the block is not known. */
  stored: ReplayShown[];
}

/** Place at which a replay stopped, and its findings. */
export interface ReplayFound {
  stopped: ReplayStopped;
  /** Firings that were run again. */
  firings: number;
  /** One number for all that happened so far: records of the same run have the same. */
  fingerprint: string;
  /** True where every value so far is that of the record, bit for bit. */
  same: boolean;
  /** Source of the last moment. */
  source: string;
  /** Number of its firing. */
  number: number;
  /** Its release, ns. */
  time_ns: number;
  /** The first difference. */
  difference: ReplayDifference | null;
  /** Cause that keeps the record from being run on, and other notes. */
  message: string;
  /** The SVVs that were asked for. */
  svvs: ReplayShown[];
}

/** An SVV at the end of a run. */
export interface ReplayShown {
  /** Its name. */
  name: string;
  /** Its C type. */
  type_text: string;
  /** Its unit. */
  unit: string;
  /** Its elements. */
  value: string[];
}

/** Reason why a run went no further. */
export type ReplayStopped = "end" | "condition" | "time" | "difference" | "unplayable";

/** State of a replay. */
export interface Replaying {
  /** True while it goes on. */
  running: boolean;
  /** Firings that were run again. */
  firings: number;
  /** Release of the last of them, ns on the recording's clock; null: there was none yet. */
  time_ns: number | null;
  /** Findings, once it is over. */
  found: ReplayFound | null;
  /** Reason why it could not be run, or not to its end. */
  failure: string | null;
}

/** The end of one start of a verb instance. */
export interface Report {
  instance: string;
  verb: string;
  /** The number of this start of the instance, from 1. */
  start: number;
  /** The termination condition. */
  condition: string;
  /** True for a normal end, which raises no exception in the programming system. */
  normal: boolean;
  /** The list that was running. */
  command_list: string;
  /** The block that reported it, if one did. */
  block: string | null;
  /** Time of the end and of the start, s on the system's clock. */
  time_s: number;
  started_s: number;
  /** The value that the condition reported, if it has one. */
  value: Value | null;
  /** The cause in words. */
  message: string;
  /**
   * Output values of the conditions on its way and of the last one: of one name, the latest. Nothing for a condition that was not reported in
   * this start.
   */
  outputs: { [name: string]: Value | null };
  others: Other[];
  /** The transitions that it took, in order: at most the last 64. */
  way: PassedList[];
}

/** Property that each device of an object must have when a verb starts. */
export interface Requirement {
  /** Parameter (or SVV), `arm.needs_home`, that must be true for the requirement to hold of a device. */
  when: string | null;
  /** Class of the refusal. */
  raises: Class;
  remedy: string;
  place: SourceLocation | null;
}

/** Property that each device of an object must have when a verb starts. */
export interface RequirementRequest {
  /** Parameter (or SVV), `arm.needs_home`, that must be true for the requirement to hold of a device. */
  when?: string | null;
  /** Class of the refusal. */
  raises: Class;
  remedy?: string;
  place?: SourceLocation | null;
}

/** An opened session with the instances that are still there of those that it has started. */
export interface Returned {
  /** Its ID, for the header `OpenGPAC-Session`. */
  session: string;
  name: string;
  role: Role;
  /** Period at which it has to give a sign of life, ms. */
  heartbeat_ms: number;
  /** Time without one after which it counts as lost, ms. */
  lost_after_ms: number;
  /** True if it was there before, and lost. */
  returned: boolean;
  /** End reports that wait for it. */
  kept_reports: number;
  /** End reports that are gone, because too many waited. */
  lost_reports: number;
  instances: SessionInstance[];
}

/** A role of a caller. */
export type Role = "observe" | "operate" | "configure" | "download";

/** A channel of a scope. */
export interface ScopeChannel {
  name: string;
  type_text: string;
  unit: string;
  /** Numbers of one value: elements of an array, members of a struct. */
  components: number;
}

/** The channels of a scope. */
export interface ScopeHead {
  /** Channels, in the order of the runs of its binary frames. */
  channels: ScopeChannel[];
}

/** One line of the list of sessions. */
export interface SessionInfo {
  name: string;
  /** Its caller: a user, a token or a certificate. */
  who: string;
  /** Name of the person who opened it, if it was given. */
  person: string | null;
  role: Role;
  /** Address from which it calls. */
  from: string;
  /** True if it has command. */
  commands: boolean;
  alive: boolean;
  /** A connection holds it: where that breaks it is lost at once. */
  held: boolean;
  kept_reports: number;
}

/** A verb instance of a session. */
export interface SessionInstance {
  instance: number;
  name: string;
  state: InstanceState;
}

/** A request for command that has ended. */
export interface SettledRequest {
  /** Counts the requests of the system. */
  number: number;
  /** The session that asked. */
  name: string;
  outcome: Outcome;
  /** The session that granted, declined or withdrew it; null: nobody did, as where its time has passed. */
  by: string | null;
  /** Reason, for people. */
  reason: string;
}

/** Urgency of an alarm. */
export type Severity = "low" | "medium" | "high" | "critical";

/** Shelving of an alarm: a time that it is out of the list. */
export interface Shelving {
  /** Person or session that shelved it. */
  who: string;
  reason: string;
  /** Time at which it began, on the system's clock and on the wall (ns since 1970; under the virtual clock the system's own). */
  time_ns: number;
  wall_ns: number;
  /** Time at which it is over at the latest. */
  until_ns: number;
  /** Time at which it ended; null while it lasts. */
  ended_ns: number | null;
  /** Person or session that ended it; empty: its time was over, or the alarm became one that cannot be shelved. */
  ended_by: string;
}

/** Shelving of an alarm: a time that it is out of the list. */
export interface ShelvingRequest {
  /** Person or session that shelved it. */
  who: string;
  reason: string;
  /** Time at which it began, on the system's clock and on the wall (ns since 1970; under the virtual clock the system's own). */
  time_ns: number;
  wall_ns: number;
  /** Time at which it is over at the latest. */
  until_ns: number;
  /** Time at which it ended; null while it lasts. */
  ended_ns?: number | null;
  /** Person or session that ended it; empty: its time was over, or the alarm became one that cannot be shelved. */
  ended_by: string;
}

/** A command in short: its name is the key of what it acts on. */
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

/** A command in short: its name is the key of what it acts on. */
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
  /** Text for people; the name if it is empty. */
  label?: string;
  /** The lower limit, in the unit of the value: below it the value is marked. */
  minimum?: number | null;
  /** The upper limit: above it the value is marked. */
  maximum?: number | null;
}

/** A block that runs by itself. */
export interface SingleBlock {
  /** `instance.label`. */
  block: string;
  /** Reason why it cannot be fused. */
  why: string;
}

/** Values at one time. */
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
 * Statistics of an interrupt source. Bin i of a histogram counts times from 2^i to 2^(i+1) ns; the first also shorter ones, the last also
 * longer ones.
 */
export interface SourceStatistics {
  /** Steps of its firing table. */
  steps: number;
  /** Firings, without those of `execute`. */
  firings: number;
  /** Releases that were skipped because the firing before was not over. */
  overruns: number;
  /** Ratio values that were absent when their reader asked for them. */
  late: number;
  /** Invocations that faulted. */
  faults: number;
  /** Conditions and other events that found no place and were lost. */
  lost: number;
  /** A fault stopped it. */
  stopped: boolean;
  /** Rights that its thread asked of the operating system and did not get. */
  rights_missing: string[];
  /** Start of the last firing behind its release, ns. */
  jitter_last_ns: number;
  /** Maximum jitter, ns. */
  jitter_max_ns: number;
  /** Histogram of the jitter. */
  jitter_bins: number[];
  /** Upper end of the bin that the median jitter lies in, ns; 0 before the first firing. */
  jitter_median_ns: number;
  /** Duration of all firings together, ns. */
  duration_sum_ns: number;
  /** Duration of the last firing, ns. */
  duration_last_ns: number;
  /** Longest duration, ns. */
  duration_max_ns: number;
  /** Histogram of the duration. */
  duration_bins: number[];
  /** Upper end of the bin that the median duration lies in, ns; 0 before the first firing. */
  duration_median_ns: number;
  processor?: string;
  /** The core that its processor is bound to. */
  core?: number | null;
  kind?: KindOfSource;
  /** Period of a timer, ns. */
  period_ns?: number | null;
  priority?: number;
  /** Rights that its thread asked of the operating system; none under the virtual clock. */
  rights_asked?: string[];
  /** True while a probe measures its blocks. */
  probed: boolean;
  /** Times of the blocks that a probe has measured since they were installed. */
  blocks: BlockTimes[];
}

/** Statistics of a system. */
export interface Statistics {
  /** Time on the system's clock, s. */
  now_s: number;
  /** Interrupt sources by name, `rtp.source`. */
  sources: { [name: string]: SourceStatistics };
  /** Verb instances in the order in which they were created. */
  instances: InstanceStatistics[];
  /** States of the logical devices. */
  devices: { [name: string]: DeviceState };
  physical_devices: { [name: string]: PhysicalDeviceStatistics };
  /** Processors by the process that they run in, of those that do not run in the supervisor's. */
  processes: { [name: string]: string[] };
  /** Cause of the latched emergency stop; null: it is not latched. */
  emergency: string | null;
  paused: PausesInForce;
  mode: Mode;
  /** Rights that the supervisor's thread asked of the operating system and did not get. */
  supervisor_rights_missing: string[];
}

/** A line of the augmented τ. */
export interface Step {
  /** A part, which stands for every list of it that the condition ends, or one list: `approach`, `approach.back_off`; or several. */
  from: NameList;
  /** A condition, by its name in the composed verb or in the part; absent: every normal end, but a halt. */
  condition?: string | null;
  /** A part, which stands for its initial list, or one list. */
  to: string;
  place?: SourceLocation | null;
}

/** A file that is there. */
export interface StoredFile {
  /** Its size. */
  bytes: number;
}

/** A text frame of the stream: what a subscription has to say, or why a frame of the client was refused. */
export interface StreamAnswer {
  /** The subscription, as its client named it. */
  id?: string | null;
  /** The heartbeat of a stream opened with `?beat=true`: what the daemon's clock says, ms. `OpenGPAC-As-Of` counts from it. */
  beat?: number | null;
  svvs?: Snapshot | null;
  statistics?: Statistics | null;
  installed?: InstalledInstances | null;
  log?: LogEntry[] | null;
  ends?: End[] | null;
  /** The first frame of a scope: what the binary ones after it carry. */
  scope?: ScopeHead | null;
  /** Frames, or entries, that the reader was too slow for since the last frame of this subscription. */
  dropped?: number | null;
  /** Reason why the subscription ended, or the frame was refused. */
  errors?: Refusal[] | null;
}

/** A frame that the client of a stream sends. */
export interface StreamFrame {
  /** Topic of the subscription. */
  subscribe?: Topic | null;
  /** The client's name of the subscription. */
  id?: string | null;
  /** The subscription that is over. */
  unsubscribe?: string | null;
  /** Names of `svvs` and `scope`. */
  names?: string[];
  /** Period of observation, ms of the wall clock, at least 10; of `statistics` and `installed` at least 100, of `scope` at most 1,000. */
  every_ms?: number;
  /** True for bytes in base64 instead of values, of `svvs`. */
  raw?: boolean;
  /** First number of `log` and `ends`. */
  since?: number;
}

/** Suspension of a verb. JSON: `"idle"`, `"hold"`, `"hold_last"`, `"safe"`, `{"holding": [{"set": "label.input", "until": "label.condition"}]}`. */
export type Suspend = "idle" | "hold" | "hold_last" | "safe" | {
  holding: Holding[];
};

/** An SVV, a private cell of an instance (`move#1:coefficients`) or a channel of a physical device (`plant.elbow.position`). */
export interface SvvAbout {
  name: string;
  kind: CellKind;
  /** C type as declared. */
  type_text: string;
  /** Declarations of the struct types that it needs, by name. */
  types: { [name: string]: string };
  /** The type with its layout. */
  type: TypeTree;
  unit: string;
  /** Number of its values that are kept. */
  history: number;
  /** The logical device that it belongs to. */
  device: string | null;
  /** Ports that write it, `instance.label.port`. */
  writers: string[];
  /** Ports that read it. */
  readers: string[];
  /** Verb instances with a port bound to it. */
  bound: number;
  /** Number of this SVV among those that have had its name; `NAME@ID` is this one and no other. */
  id?: number;
  /** Minimum and maximum that a programming system may write, where both are finite. */
  within?: [number, number] | null;
  /** The interrupt source in which its present value was computed; null: a programming system wrote it. */
  source?: string | null;
}

export type SvvId = number;

/** An SVV as it is asked for: its specification, and the struct types that its type needs. */
export interface SvvRequest {
  /** C type. */
  type_text: string;
  unit?: string;
  initial?: Initial | null;
  /** Number of earlier values that are kept for Python. */
  history?: number;
  /** The values that the PS may store. */
  within?: Within | null;
  /** The PS keeps its value over a warm restart. */
  keep?: boolean | null;
  /** Name of the system's SVV that the devices of a type share: they have none of their own. */
  shared?: string | null;
  types?: { [name: string]: string };
}

export interface SvvSpecification {
  /** C type. */
  type_text: string;
  unit: string;
  initial: Initial | null;
  /** Number of earlier values that are kept for Python. */
  history: number;
  /** The values that the PS may store. */
  within: Within | null;
  /** The PS keeps its value over a warm restart. */
  keep?: boolean | null;
  /** Name of the system's SVV that the devices of a type share: they have none of their own. */
  shared: string | null;
}

export interface SvvSpecificationRequest {
  /** C type. */
  type_text: string;
  unit?: string;
  initial?: Initial | null;
  /** Number of earlier values that are kept for Python. */
  history?: number;
  /** The values that the PS may store. */
  within?: Within | null;
  /** The PS keeps its value over a warm restart. */
  keep?: boolean | null;
  /** Name of the system's SVV that the devices of a type share: they have none of their own. */
  shared?: string | null;
}

/** `POST /v1/command`. */
export interface TakeCommand {
  /** Takes it from the holder; needs the role `configure`. */
  force?: boolean;
}

/** Result for each process of processors. */
export interface TakenOver {
  /** Results, in the order of their names. */
  processors: ProcessTakenOver[];
}

/** A taught point: joint positions, or a pose in a frame with the joints at which it was taught. */
export interface TaughtPoint {
  name: string;
  /** Positions of the joints when it was taught, in the order of the arm, rad or m. */
  joints: number[];
  /** `joints` of joint positions; `world` or the name of a work frame of a pose. */
  frame: string;
  /** Frame of `tools` whose pose it is; null: the tool that the arm has. */
  tool: string | null;
  /** Place in its frame, m. */
  position: [number, number, number] | null;
  /** Roll, pitch and yaw in its frame, degrees. */
  rpy_deg: [number, number, number] | null;
  /** Signs of shoulder, elbow and wrist, where the arm has such configurations. */
  configuration: string | null;
  /** Turns of the joints in that configuration. */
  turns: number[];
  /** Words for people. */
  note: string;
  /** Time at which it was taught, RFC 3339. */
  taught: string | null;
}

/** A taught point: joint positions, or a pose in a frame with the joints at which it was taught. */
export interface TaughtPointRequest {
  name: string;
  /** Positions of the joints when it was taught, in the order of the arm, rad or m. */
  joints: number[];
  /** `joints` of joint positions; `world` or the name of a work frame of a pose. */
  frame?: string;
  /** Frame of `tools` whose pose it is; null: the tool that the arm has. */
  tool?: string | null;
  /** Place in its frame, m. */
  position?: [number, number, number] | null;
  /** Roll, pitch and yaw in its frame, degrees. */
  rpy_deg?: [number, number, number] | null;
  /** Signs of shoulder, elbow and wrist, where the arm has such configurations. */
  configuration?: string | null;
  /** Turns of the joints in that configuration. */
  turns?: number[];
  /** Words for people. */
  note?: string;
  /** Time at which it was taught, RFC 3339. */
  taught?: string | null;
}

/** The taught points of an arm. */
export interface TaughtPoints {
  /** Path of the file on the host of the system. */
  file: string;
  /** Joints of the arm, by their short names. */
  joints: string[];
  /** In the order of the file. */
  points: TaughtPoint[];
  frames: NamedFrame[];
  tools: NamedFrame[];
}

/** A termination condition: an element of t_V with its ν. */
export interface Termination {
  /** Block conditions (`label.item`) it stands for; empty: the system condition of its own name. */
  on: NameList;
  /** ν: outputs it returns. Absent: none declared. */
  returns: NameList | null;
  /** True if it raises on the PS (the PS knows which class): so, or by the name of the class. */
  raises: RaiseMark;
  /** Command lists to which it is limited; empty: all. In JSON one name, or several. */
  during: NameList;
  priority: number;
  /** Code of the alarm that it raises whenever it acts, whether the verb ends or goes on. */
  alarm: string | null;
  place: SourceLocation | null;
}

/** A termination condition: an element of t_V with its ν. */
export interface TerminationRequest {
  /** Block conditions (`label.item`) it stands for; empty: the system condition of its own name. */
  on?: NameList;
  /** ν: outputs it returns. Absent: none declared. */
  returns?: NameList | null;
  /** True if it raises on the PS (the PS knows which class): so, or by the name of the class. */
  raises?: RaiseMark;
  /** Command lists to which it is limited; empty: all. In JSON one name, or several. */
  during?: NameList;
  priority?: number;
  /** Code of the alarm that it raises whenever it acts, whether the verb ends or goes on. */
  alarm?: string | null;
  place?: SourceLocation | null;
}

/** A time with its unit: `20 ms`. */
export type Time = string;

/** End of parts that run together. */
export type TogetherUntil = "any" | "all";

/**
 * Topic of a stream. `scope`: every value of some SVVs and private cells, in binary frames; `installed`: at first, and whenever it
 * has changed.
 */
export type Topic = "svvs" | "log" | "ends" | "scope" | "statistics" | "installed";

/** One line of τ. */
export interface Transition {
  from: string;
  condition: string;
  to: string;
  place: SourceLocation | null;
}

/** One line of τ. */
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
  /** The normalised declaration. */
  text: string;
  /** Bytes of a value, padding included. */
  size: number;
  /** Alignment, bytes. */
  align: number;
};

/** End of a wait. */
export type Until = boolean | NameList;

/** A value of a parameter, preset, SVV or output. In JSON it is what it looks like. */
export type Value = boolean | number | string | Value[] | { [name: string]: Value } | null;

/**
 * A verb (f_V, p_V, o_V, inst_V, χ, ψ, ω, c_V, t_V, τ, ν).
 *
 * In a composed verb, one with `parts`, blocks, cells and lists carry the label of their part (`close.start`). So do the keys of
 * `conditions` and `output_values`, which may then hold one line for each part; what reports and τ call them is [`Verb::reported`].
 */
export interface Verb {
  name: string;
  doc: string;
  /** True if it may be started in manual mode. */
  manual: boolean;
  blocks: { [name: string]: WrittenBlockUse };
  objects: { [name: string]: WrittenObject };
  /** χ: parameter (`sensed`, `drive.position`, `arm.commanded`) → data nodes. */
  instantiation_parameters: { [name: string]: NameList };
  /** Private SVVs of each instance; part of χ. */
  cells: { [name: string]: NameList };
  input_parameters: { [name: string]: WrittenInputParameter };
  /** Members of objects, SVVs or parameters of type bool, that must be true at a start: `arm.homed`. */
  requires: { [name: string]: WrittenRequirement };
  /** ω. */
  output_values: { [name: string]: string };
  command_lists: { [name: string]: WrittenCommandList };
  initial: string | null;
  conditions: { [name: string]: WrittenTermination };
  transitions: Transition[];
  /** Relaxed modes: port → mode. */
  modes: { [name: string]: PortMode };
  /** Parts of a composed verb by label, and those of its parts (`pick.approach`). Empty in one that is written whole. */
  parts: { [name: string]: Part };
  /** The command list that runs at every end, but at an emergency stop, a lost processor and a second halt (brakes, a ramp down). */
  ending: string | null;
  /**
   * Running time after which an ending list, what τ leads to from a disabled device or an abort, and a suspension that waits for
   * its condition are cut short, ns; absent: [`ENDING_LIMIT_NS`].
   */
  ending_limit_ns: number | null;
  suspend: Suspend;
  /**
   * Action of a running instance when the programming system that started it is cut off; absent: an action is halted, the own verb
   * of a logical device continues.
   */
  if_cut_off: IfCutOff | null;
  place: SourceLocation | null;
}

/** The paper's two classes of verbs. */
export type VerbClass = "acts on devices" | "supports devices";

/** The inputs that a start of the verb asks for. */
export interface VerbForm {
  name: string;
  doc: string;
  /** True if it may be started in manual mode. */
  manual: boolean;
  /** Arguments with which an instance is made. */
  arguments: FormArgument[];
  /** The values that a start may be given. */
  inputs: FormInput[];
  /** The definition itself. */
  defined: Verb;
}

/**
 * A verb (f_V, p_V, o_V, inst_V, χ, ψ, ω, c_V, t_V, τ, ν).
 *
 * In a composed verb, one with `parts`, blocks, cells and lists carry the label of their part (`close.start`). So do the keys of
 * `conditions` and `output_values`, which may then hold one line for each part; what reports and τ call them is [`Verb::reported`].
 */
export interface VerbRequest {
  name: string;
  doc?: string;
  /** True if it may be started in manual mode. */
  manual?: boolean;
  blocks: { [name: string]: WrittenBlockUseRequest };
  objects?: { [name: string]: WrittenObjectRequest };
  /** χ: parameter (`sensed`, `drive.position`, `arm.commanded`) → data nodes. */
  instantiation_parameters?: { [name: string]: NameList };
  /** Private SVVs of each instance; part of χ. */
  cells?: { [name: string]: NameList };
  input_parameters?: { [name: string]: WrittenInputParameterRequest };
  /** Members of objects, SVVs or parameters of type bool, that must be true at a start: `arm.homed`. */
  requires?: { [name: string]: WrittenRequirementRequest };
  /** ω. */
  output_values?: { [name: string]: string };
  command_lists: { [name: string]: WrittenCommandListRequest };
  initial?: string | null;
  conditions?: { [name: string]: WrittenTerminationRequest };
  transitions?: TransitionRequest[];
  /** Relaxed modes: port → mode. */
  modes?: { [name: string]: PortMode };
  /** Parts of a composed verb by label, and those of its parts (`pick.approach`). Empty in one that is written whole. */
  parts?: { [name: string]: Part };
  /** The command list that runs at every end, but at an emergency stop, a lost processor and a second halt (brakes, a ramp down). */
  ending?: string | null;
  /**
   * Running time after which an ending list, what τ leads to from a disabled device or an abort, and a suspension that waits for
   * its condition are cut short, ns; absent: [`ENDING_LIMIT_NS`].
   */
  ending_limit_ns?: number | null;
  suspend?: Suspend;
  /**
   * Action of a running instance when the programming system that started it is cut off; absent: an action is halted, the own verb
   * of a logical device continues.
   */
  if_cut_off?: IfCutOff | null;
  place?: SourceLocation | null;
}

/** A verb in one line. */
export interface VerbSummary {
  name: string;
  doc: string;
  class: VerbClass;
  /** The device types that it supports. */
  supports: string[];
  /** True if it has one command list. */
  simple: boolean;
  /** Names of its command lists. */
  lists: string[];
  /** Parts of a composed verb, by label. */
  parts: { [name: string]: Part };
}

/** A port, and why it cannot be wired; no reason: it can. */
export interface Verdict {
  block: string;
  port: string;
  reason: string | null;
}

/** Version of the server, and the caller as it sees it. */
export interface Version {
  /** Version of OpenGPAC. */
  opengpac: string;
  /** Version of the control interface. */
  interface: number;
  /** Version of the block interface, for shared objects. */
  abi: number;
  /** The machine, for shared objects: `x86_64-linux`. */
  target: string;
  /** Name of the real-time system. */
  system: string;
  /** Identifier of this life of the system: a system that was started again has another, and its log and its numbers begin again. */
  run: string;
  clock: ClockName;
  /** Role of the caller. */
  role: Role;
}

/** A part of a definition, as who draws it knows it. JSON: `{"block": "filter", "port": "u"}`, `{"transition": ["start", "contact"]}`, … */
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

/** `DELETE /v1/command/request`. */
export interface WithdrawRequest {
  /** Reason, for people. */
  reason?: string;
}

/**
 * The range of a member of a device type, or of an SVV. JSON: `"(0, inf)"`, or two ends, each a number or the name of a parameter of the
 * device, `["position_min", "position_max"]`, `["-max_effort", "max_effort"]`.
 */
export type Within = Range | [Bound, Bound];

/** A layout of panels. */
export interface Workspace {
  /** Name among the workspaces of the system. */
  name: string;
  /** Text for people; the name if it is empty. */
  title?: string;
  /** Purpose of the workspace. */
  doc?: string;
  /** True if it is a panel for operators: large buttons and values, and nothing can be changed in it. */
  operator?: boolean;
  layout: Region;
}

/** A workspace in one line. */
export interface WorkspaceAbout {
  name: string;
  title: string;
  doc: string;
  /** True if it is a panel for operators. */
  operator: boolean;
  /** A program has shipped it: people do not change it. */
  shipped: boolean;
  /** Number that changes with every change. */
  revision: number;
}

/** A layout of panels. */
export interface WorkspaceRequest {
  /** Name among the workspaces of the system. */
  name: string;
  /** Text for people; the name if it is empty. */
  title?: string;
  /** Purpose of the workspace. */
  doc?: string;
  /** True if it is a panel for operators: large buttons and values, and nothing can be changed in it. */
  operator?: boolean;
  layout: RegionRequest;
}

export type WrittenBlockSource = string | BlockSource;

export type WrittenBlockSourceRequest = string | BlockSourceRequest;

export type WrittenBlockUse = string | BlockUse;

export type WrittenBlockUseRequest = string | BlockUseRequest;

/** A command, long or short. */
export type WrittenCommand = Command | ShortCommand;

export type WrittenCommandList = Commands | CommandList;

export type WrittenCommandListRequest = CommandsRequest | CommandListRequest;

/** A command, long or short. */
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
  /** Makes a real-time processor. */
  processor: {
    role: "configure";
    arguments: {
      name: string;
      /** The core that it is bound to. */
      core?: number | null;
      /** true: the supervisor is there; if no processor says so, it is on the first one. */
      supervisor?: boolean;
      /** true: in a process of its own; a text: in the process of that name. */
      process?: InProcess;
      /** A host that has joined. */
      host?: string | null;
      /** Time for which a process may stand still until it counts as lost. */
      lost_after_ns?: number | null;
      /** Time for which a process may miss its supervisor. */
      patience_ns?: number | null;
    };
    result: null;
  };
  /** Lets other hosts join. */
  listen: {
    role: "download";
    arguments: {
      /** "tcp/HOST:PORT" or "tls/HOST:PORT". */
      endpoint: string;
      /** The name of this host. */
      name: string;
      /** The file of the authority that signs the others' certificates. */
      authority?: string | null;
      certificate?: string | null;
      key?: string | null;
      /** The text that a host must know to join. */
      token?: string | null;
      /** Maximum difference of the clocks. */
      clock_limit_ns?: number | null;
    };
    result: null;
  };
  /** Lets go on what runs in processes that lost a system of this name; the system is opened with "adopt": true. */
  take_over: {
    role: "configure";
    arguments: Record<string, never>;
    result: TakenOver;
  };
  /** Makes an interrupt source of a processor. */
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
      /** Cost of a firing under the virtual clock. */
      virtual_cost_ns?: number;
    };
    result: null;
  };
  /** Requests a software source: it fires once. */
  request: {
    role: "operate";
    arguments: {
      /** "processor.source". */
      source: string;
    };
    result: null;
  };
  /** Opens a device for a source. Returns its channels and parts. */
  physical_device: {
    role: "configure";
    arguments: {
      processor: string;
      name: string;
      /** The driver: "mujoco", "loopback", "scripted", ... */
      kind: string;
      /** Options of the driver. */
      options?: { [name: string]: unknown } | null;
      source: string;
      place?: SourceLocation | null;
    };
    result: PhysicalDevice;
  };
  /** Lets the driver of a device carry out a service, off the cycle. Returns what that answers. */
  device_service: {
    role: "operate";
    arguments: {
      device: string;
      /** Service that the driver declares: `configuration` lists them. */
      service: string;
      /** Arguments of the service. */
      arguments?: { [name: string]: unknown } | null;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: Value | null;
  };
  /** Looks on the host of the system for devices that a driver could open; nothing moves. Returns what each is, and the options that open it. */
  scan_devices: {
    role: "configure";
    arguments: {
      /** The driver. */
      kind: string;
      /** Options of the driver that say where to look. */
      options?: { [name: string]: unknown } | null;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: Value | null;
  };
  /** Waits for a service or a search that goes on. Returns what it answers, once. */
  device_served: {
    role: "operate";
    arguments: {
      errand: number;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: Value | null;
  };
  /** Opens a device that was lost again, with everything that is bound to it. */
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
  /** Lets a channel of a device request a source. */
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
  /** Says on which sources blocks run that nothing else places: source by pattern of labels. */
  place: {
    role: "configure";
    arguments: { [name: string]: string };
    result: null;
  };
  /** Enters a verb. */
  define_verb: {
    role: "configure";
    arguments: VerbRequest;
    result: null;
  };
  /** Refuses a data flow graph that is wrong; nothing is entered. */
  check_graph: {
    role: "observe";
    arguments: GraphRequest;
    result: null;
  };
  /** Returns all that is wrong with a graph or a verb, each with "where"; nothing is entered. */
  check_definition: {
    role: "observe";
    arguments: Drawing;
    result: Refusal[];
  };
  /** Returns all that is wrong with a graph or a verb, as `check_definition` does, and what installing it would refuse whatever it is given: constants, defaults, members of objects, second writers in a list. Nothing is entered. */
  check_drawing: {
    role: "observe";
    arguments: Drawing;
    result: Refusal[];
  };
  /** Returns why two ports of a graph or a verb cannot be wired, or null; without `to`, why each other one cannot. */
  compatible: {
    role: "observe";
    arguments: ({
      from: PortName;
      to?: PortName | null;
    }) & Drawing;
    result: PortVerdicts;
  };
  /** Enters a type of logical devices. */
  define_device_type: {
    role: "configure";
    arguments: DeviceTypeRequest;
    result: null;
  };
  /** Returns the verb that a composition of verbs is; nothing is entered. */
  compose: {
    role: "observe";
    arguments: Composition;
    result: Verb;
  };
  /** Makes an SVV. */
  svv: {
    role: "configure";
    arguments: ({
      name: string;
      place?: SourceLocation | null;
    }) & SvvRequest;
    result: null;
  };
  /** Deletes an SVV that nothing is bound to. */
  delete_svv: {
    role: "configure";
    arguments: {
      name: string;
    };
    result: null;
  };
  /** Returns every block: of the library, of code modules. */
  library: {
    role: "observe";
    arguments: Record<string, never>;
    result: Interface[];
  };
  /** Fuses blocks in C that are always due together, for a second; with groups `waiting` it is to be called again. Returns what is fused. */
  fuse: {
    role: "configure";
    arguments: {
      /** False undoes it. */
      on?: boolean | null;
    };
    result: FusedBlocks;
  };
  /** Returns what is fused, and what is not and why. */
  fused: {
    role: "observe";
    arguments: Record<string, never>;
    result: FusedBlocks;
  };
  /** Makes a logical device, with its own verb instance. */
  device: {
    role: "configure";
    arguments: {
      name: string;
    } & DeviceRequest;
    result: null;
  };
  /** Starts the verb that keeps a device going. Returns that instance, 0 where there is none. It is enabled when it is ready. */
  enable: {
    role: "operate";
    arguments: {
      name: string;
    };
    result: number;
  };
  /** Waits until a device is enabled. Returns whether it is. */
  wait_enabled: {
    role: "observe";
    arguments: {
      name: string;
      /** Time limit from now, on the system's clock. */
      timeout_ns?: number | null;
      /** Time of the limit, instead. */
      until_ns?: number | null;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: boolean;
  };
  /** Ends the verbs that use a device, then its own; waits until that is done. */
  disable: {
    role: "operate";
    arguments: {
      name: string;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: null;
  };
  /** Replaces the verb that keeps a device going by another one, within one firing where it is enabled. */
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
  /** Returns "disabled", "enabling", "standstill", "moving", "stopping" or "fault". */
  device_state: {
    role: "observe";
    arguments: {
      name: string;
    };
    result: DeviceState;
  };
  /** Returns the value of a parameter. */
  device_parameter: {
    role: "observe";
    arguments: {
      name: string;
      parameter: string;
    };
    result: Value;
  };
  /** Sets a parameter. */
  set_device_parameter: {
    role: "operate";
    arguments: {
      name: string;
      parameter: string;
      value: Value;
    };
    result: null;
  };
  /** Enters an arm, in the place of the one of that name: its joints, and the geometry that joins them or the reason why it is not known. */
  describe_arm: {
    role: "configure";
    arguments: ArmDescriptionRequest;
    result: null;
  };
  /** Returns the arms whose joints are there. */
  arms: {
    role: "observe";
    arguments: Record<string, never>;
    result: ArmDescription[];
  };
  /** Returns the taught points of an arm as its file has them now, with its frames and tools. */
  points: {
    role: "observe";
    arguments: {
      arm: string;
    };
    result: TaughtPoints;
  };
  /** Enters a taught point into the file of an arm, in the place of the one of that name. */
  teach_point: {
    role: "operate";
    arguments: {
      arm: string;
      point: TaughtPointRequest;
    };
    result: null;
  };
  /** Gives a taught point another name; it keeps its place. */
  rename_point: {
    role: "operate";
    arguments: {
      arm: string;
      name: string;
      to: string;
    };
    result: null;
  };
  /** Removes a taught point, and returns it. */
  delete_point: {
    role: "operate";
    arguments: {
      arm: string;
      name: string;
    };
    result: TaughtPoint;
  };
  /** Plans an application without making anything. Returns the plan. */
  check: {
    role: "observe";
    arguments: ApplicationRequest;
    result: Plan;
  };
  /** Calls a verb: makes an instance, starts it with the values of the application, waits until it has ended and deletes it. Returns its end report. */
  perform: {
    role: "operate";
    arguments: {
      limits?: Limits;
      /** How long this request may last, ms. */
      slice_ms?: number;
    } & ApplicationRequest;
    result: Report | null;
  };
  /** Goes on with the call of a verb: waits until its instance has ended and deletes it. Returns its end report. */
  performed: {
    role: "operate";
    arguments: {
      instance: number;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: Report | null;
  };
  /** Makes an instance. Returns its number. */
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
      /** Input parameter to value. */
      values?: { [name: string]: Value };
      limits?: Limits;
    };
    result: null;
  };
  /** Waits until an instance has ended. Returns its end report, null after the timeout. */
  wait: {
    role: "observe";
    arguments: {
      instance: number;
      /** Time limit from now, on the system's clock. */
      timeout_ns?: number | null;
      /** Time of the limit, instead. */
      until_ns?: number | null;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: Report | null;
  };
  /** Ends an instance and waits until it has ended: a transition on `halted` may lie between, a second halt is immediate. Returns its end report. */
  halt: {
    role: "operate";
    arguments: {
      instance: number;
      /** Time limit from now, on the system's clock. */
      timeout_ns?: number | null;
      /** Time of the limit, instead. */
      until_ns?: number | null;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: Report | null;
  };
  /** Lets what an instance is doing run dry, then holds it. */
  suspend: {
    role: "operate";
    arguments: {
      instance: number;
    };
    result: null;
  };
  /** Lets a suspended instance go on. */
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
  /** Returns "created", "queued", "running", "suspended", "ended" or "deleted". */
  state: {
    role: "observe";
    arguments: {
      instance: number;
    };
    result: InstanceState;
  };
  /** Returns what an instance is: its name, verb, state, blocks, conditions and lists. */
  instance: {
    role: "observe";
    arguments: {
      instance: number;
    };
    result: InstanceAbout;
  };
  /** Returns the end report of the latest start, null while it lasts. */
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
      /** Input parameter to value. */
      values?: { [name: string]: Value };
      /** Label of a block to interval. */
      every_ns?: { [name: string]: number };
    };
    result: null;
  };
  /** Returns one consistent snapshot. */
  read: {
    role: "observe";
    arguments: {
      /** Names of SVVs, of private cells, "move#1:coefficients", and of channels, "plant.elbow.position". */
      names: string[];
      /** Instead of "value", which cannot say NaN or infinity in JSON: "bytes", the memory of the C type in base64, little endian. */
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
  /** Returns the last values, oldest first. */
  history: {
    role: "observe";
    arguments: {
      name: string;
      /** Maximum number of values. */
      count: number;
      /** "bytes" instead of "value", as of `read`. */
      raw?: boolean;
    };
    result: Reading[];
  };
  /** Returns what is known of an SVV, a private cell or a channel: its type, unit, history, writers. */
  svv_about: {
    role: "observe";
    arguments: {
      name: string;
    };
    result: SvvAbout;
  };
  /** Returns the time of the system, ns. */
  now: {
    role: "observe";
    arguments: Record<string, never>;
    result: number;
  };
  /** Under the virtual clock: runs the firings in (now, now + duration]. */
  advance: {
    role: "operate";
    arguments: {
      duration_ns: number;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: null;
  };
  /** Under the virtual clock: runs the next firing, whenever that is. Returns false where nothing is ever going to happen. */
  step: {
    role: "operate";
    arguments: Record<string, never>;
    result: boolean;
  };
  /** Stops everything that moves, until `reset`. */
  emergency_stop: {
    role: "operate";
    arguments: {
      reason: string;
    };
    result: null;
  };
  /** Lets a channel of a device stop everything that moves. */
  emergency_stop_input: {
    role: "configure";
    arguments: {
      device: string;
      channel: string;
      /** True if it stops at zero, not at one. */
      at_zero?: boolean;
    };
    result: null;
  };
  /** Ends the emergency stop, and opens devices again that were lost. Returns those that are lost still, each with why. */
  reset: {
    role: "operate";
    arguments: Record<string, never>;
    result: { [name: string]: string };
  };
  /** Suspends what is done with these logical devices, or with all, and waits until it is. Returns the names of these instances. */
  pause: {
    role: "operate";
    arguments: {
      devices?: string[] | null;
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: string[];
  };
  /** Waits until these instances have stopped. Returns their names. */
  paused: {
    role: "operate";
    arguments: {
      instances: number[];
      names: string[];
      /** How long this request may last, ms. */
      slice_ms?: number;
    };
    result: string[];
  };
  /** Takes a pause back. Returns the names of the instances that go on or begin. */
  resume_program: {
    role: "operate";
    arguments: {
      devices?: string[] | null;
    };
    result: string[];
  };
  /** Returns "automatic" or "manual". */
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
  /** Names the channel of the enabling switch, without which nothing moves in manual mode. */
  enabling_switch: {
    role: "configure";
    arguments: {
      device: string;
      channel: string;
    };
    result: null;
  };
  /** Says what the alarms of a code mean. */
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
  /** Says that the cause of an alarm is gone. Returns whether there was one. */
  clear_alarm: {
    role: "operate";
    arguments: {
      code: string;
      source?: string | null;
    };
    result: boolean;
  };
  /** Returns all alarms, those that are shelved, and their history. */
  alarms: {
    role: "observe";
    arguments: Record<string, never>;
    result: Alarms;
  };
  /** Acknowledges one alarm, or all that are not shelved. Returns how many. */
  acknowledge_alarms: {
    role: "operate";
    arguments: {
      number?: number | null;
    };
    result: number;
  };
  /** Takes an alarm out of the list for a time. Emergency stops, what is lost, and the severity critical stay in it. */
  shelve_alarm: {
    role: "operate";
    arguments: {
      number: number;
      /** Reason for it. */
      reason: string;
      /** Duration on the system's clock: 24 h at most. */
      for_ns: number;
      /** Person or session that shelves it: the control interface enters its caller. */
      who?: string | null;
    };
    result: null;
  };
  /** Puts a shelved alarm back into the list. Returns whether it was shelved. */
  unshelve_alarm: {
    role: "operate";
    arguments: {
      number: number;
      /** Person or session that does it: the control interface enters its caller. */
      who?: string | null;
    };
    result: boolean;
  };
  /** Enters the history of an earlier life. */
  restore_alarms: {
    role: "configure";
    arguments: {
      history: AlarmRequest[];
    };
    result: null;
  };
  /** Returns the names of what there is. */
  names: {
    role: "observe";
    arguments: Record<string, never>;
    result: Names;
  };
  /** Returns processors, sources, devices as their drivers describe them, device types. */
  configuration: {
    role: "observe";
    arguments: Record<string, never>;
    result: Configuration;
  };
  /** Returns every instance with its blocks, ports, cells, command lists, conditions and transitions. */
  installed: {
    role: "observe";
    arguments: Record<string, never>;
    result: InstalledInstances;
  };
  /** Returns the verbs that are entered. */
  verbs: {
    role: "observe";
    arguments: Record<string, never>;
    result: VerbSummary[];
  };
  /** Returns what a form that starts a verb needs: its arguments and input parameters. */
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
  /** Returns how sources, instances and devices run. */
  statistics: {
    role: "observe";
    arguments: Record<string, never>;
    result: Statistics;
  };
  /** Visits the blocks of a source, or of all, one a firing: then `statistics` tells how long they take. */
  probe: {
    role: "observe";
    arguments: {
      source?: string | null;
      /** Amount of real time, an hour at most. */
      for_ns: number;
    };
    result: null;
  };
  /** Returns commands, conditions, faults, transitions and ends. */
  log: {
    role: "observe";
    arguments: {
      /** The number of the first one. */
      since?: number;
    };
    result: LogEntry[];
  };
  /** Enters a workspace that a program ships, in the place of the one that it shipped before under that name. */
  ship_workspace: {
    role: "configure";
    arguments: WorkspaceRequest;
    result: null;
  };
  /** Removes a workspace that a program has shipped. */
  withdraw_workspace: {
    role: "configure";
    arguments: {
      name: string;
    };
    result: null;
  };
  /** Keeps a workspace for all who look at the system. One that a program has shipped is not replaced. */
  keep_workspace: {
    role: "operate";
    arguments: WorkspaceRequest;
    result: null;
  };
  /** Removes a workspace that a person keeps. */
  forget_workspace: {
    role: "operate";
    arguments: {
      name: string;
    };
    result: null;
  };
  /** Returns the workspaces, each in one line. */
  workspaces: {
    role: "observe";
    arguments: Record<string, never>;
    result: WorkspaceAbout[];
  };
  /** Returns a workspace. */
  workspace: {
    role: "observe";
    arguments: {
      name: string;
    };
    result: Workspace;
  };
  /** Returns all that is wrong with a workspace here and now: its form, and what it names and is not there. */
  check_workspace: {
    role: "observe";
    arguments: WorkspaceRequest;
    result: Refusal[];
  };
  /** Begins to record into a new MCAP file. Returns its number. */
  record: {
    role: "configure";
    arguments: {
      path: string;
      /** Names of SVVs, with * and ?; all where they are left out. */
      svvs?: string[] | null;
      /** The private cells of all verb instances too. */
      cells?: boolean;
      /** Everything that comes from outside too, so that the run can be run again. */
      replay?: boolean;
      /** Bytes of a file, about, from which on the next one begins: run.mcap, run-2.mcap and so on. A recording for a replay has none. */
      split_bytes?: number | null;
      /** Files that stay where the recording is split; the oldest goes. All where it is left out. */
      keep?: number | null;
      /** Identity of the recording, which its files have in their metadata. Over the control interface the daemon gives it one. */
      identity?: string | null;
      /**
       * true: goes on behind the files of that path that are there, and those of this identity count for `keep`. Over the control
       * interface it is the daemon's own, and is left out.
       */
      resumes?: boolean;
    };
    result: RecordingBegun;
  };
  /** Returns how a recording stands. */
  recording: {
    role: "observe";
    arguments: {
      recording: number;
    };
    result: RecordingSummary;
  };
  /** Ends a recording. Returns how it stands; where it still runs, it is to be called again. */
  stop_recording: {
    role: "configure";
    arguments: {
      recording: number;
    };
    result: RecordingSummary;
  };
  /** Begins to run a recording again, in a process of its own beside the system, which it does not touch, and compares every value. Returns its number. Code modules that the recording brings run only where their SHA-256 digests are those of modules that the system has had, or are in `trust`. */
  replay: {
    role: "configure";
    arguments: {
      path: string;
      /** Digests of code modules that may run. Over the control interface they are the daemon's own, and are left out. */
      trust?: string[];
      /** true: the modules of the same names that the system has now take the place of the recording's; then the first difference is of them. */
      present?: boolean;
    };
    result: ReplayBegun;
  };
  /** Returns how a replay stands. */
  replaying: {
    role: "observe";
    arguments: {
      replay: number;
    };
    result: Replaying;
  };
  /** Ends a replay where it is, and forgets it. Returns how it stood. */
  stop_replay: {
    role: "configure";
    arguments: {
      replay: number;
    };
    result: Replaying;
  };
  /** Returns the recordings of a folder, the newest first. */
  recordings: {
    role: "observe";
    arguments: {
      /** Over the control interface it is the daemon's own, and is left out. */
      folder?: string;
    };
    result: RecordingFile[];
  };
  /** Returns what a recording is: when, of what, how it ended. One that is under way is told as far as it is on the disk. */
  recorded: {
    role: "observe";
    arguments: {
      path: string;
    };
    result: RecordingContents;
  };
  /** Returns what was at a time of a recording. */
  recorded_at: {
    role: "observe";
    arguments: {
      path: string;
      /** Time on the system's clock. */
      time_ns: number;
      /** Names of SVVs and cells. */
      names?: string[];
      /** Names of other channels, `/installed`, `/statistics`, `/alarms`, … */
      topics?: string[];
      /** Times of the messages that the caller has, by channel: they are not told again. */
      known?: { [name: string]: number };
    };
    result: RecordedAt;
  };
  /** Returns messages of a channel that has no values, `/log`, `/ends`, … */
  recorded_messages: {
    role: "observe";
    arguments: {
      path: string;
      topic: string;
      /** The number of the first one. */
      since?: number;
    };
    result: RecordedMessages;
  };
  /** Returns SVVs and cells over a span of a recording, drawn together into columns, with exact sums. */
  recorded_span: {
    role: "observe";
    arguments: {
      path: string;
      names: string[];
      from_ns: number;
      to_ns: number;
      /** Columns of each channel, at most 10,000: as many values as lie in one are drawn together. */
      columns: number;
      /** The `next` of the part before. */
      since?: number;
    };
    result: RecordedSpan;
  };
  /** Returns the time of the next firing of a recording that stored a value, or of the one before; null where there is none. */
  recorded_firing: {
    role: "observe";
    arguments: {
      path: string;
      time_ns: number;
      /** The one before. */
      back?: boolean;
    };
    result: number | null;
  };
}

/** The calls that last, and go on in slices. */
export const LASTING: ReadonlySet<string> = new Set(["device_service", "scan_devices", "device_served", "wait_enabled", "disable", "perform", "performed", "wait", "halt", "advance", "pause", "paused"]);
