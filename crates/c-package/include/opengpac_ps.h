/* SPDX-License-Identifier: Apache-2.0 */
/* opengpac_ps.h: the programming system's side of OpenGPAC, for C and for whatever calls C.
 *
 * A program opens a real-time system, configures it, enters verbs, makes instances of them, starts them and waits for their reports.
 * Everything goes by texts: a call has a name and the JSON text of an object; its result is the JSON text of a value.
 *
 *     opengpac_system *cell = opengpac_open("cell", "virtual", "{}");
 *     char *none = opengpac_call(cell, "processor", "{\"name\": \"rtp0\"}");
 *     if (!none) fprintf(stderr, "%s\n", opengpac_error());
 *     opengpac_free(none);
 *     opengpac_close(cell);
 *
 * Link with -lopengpac_ps. Any thread may call; opengpac_error() is of the calling thread. None is for the real-time path. */
#ifndef OPENGPAC_PS_H
#define OPENGPAC_PS_H

#ifdef __cplusplus
extern "C" {
#endif

/* A real-time system in this process. */
typedef struct opengpac_system opengpac_system;

/* Opens a system. clock: "monotonic", or "virtual" (time is then advanced by waits, and by the call "advance"). options: "{}", or
 * {"seed": n, "interconnect": {"kind": "memory"}}. NULL where it is refused: see opengpac_error(). */
opengpac_system *opengpac_open(const char *name, const char *clock, const char *options);

/* Makes one call of the list below. arguments: a JSON object; NULL or "" for none. Returns JSON text, to be given to opengpac_free();
 * "null" where there is nothing to tell. NULL where it is refused, and then nothing has changed: see opengpac_error(). */
char *opengpac_call(opengpac_system *system, const char *call, const char *arguments);

/* Why the last call of this thread was refused: one line for each thing that is wrong, with the next step. "" where it was not. The
 * text is valid until the next call of this thread. */
const char *opengpac_error(void);

/* The same as JSON: [{"class", "message", "ends", "remedy", "place"}]. */
const char *opengpac_error_json(void);

/* A descriptor that becomes readable when an instance has ended, for poll() and event loops; drain it with an 8-byte read(). Monotonic
 * clock only. Then call "report" or "log". -1 for NULL. */
int opengpac_ended_fd(opengpac_system *system);

/* Gives back a text of opengpac_call(). NULL is nothing. */
void opengpac_free(char *text);

/* Halts the actions, disables the devices, stops the kernels, and frees the system. NULL is nothing. No other thread may be in a call. */
void opengpac_close(opengpac_system *system);

/* The calls. Names of sources are "processor.source", times are ns. What stands in [brackets] may be left out; behind ... stands what is
 * the rest of the object. Names of values are those of SVVs, of private cells, "move#1:coefficients", and of channels, "plant.elbow.position".
 *
 * ---- the calls, generated from their declarations in crates/api ----
 * configuration
 *   processor(name, [core], [supervisor], [process], [host], [lost_after_ns], [patience_ns])
 *       Creates a real-time processor.
 *         core: CPU core to which the processor is bound.
 *         supervisor: True if the supervisor runs on the processor; by default it runs on the first one.
 *         process: True for its own process, or the name of a shared process.
 *         host: Name of a host that has joined the system.
 *         lost_after_ns: Maximum time for which the process may hang before it counts as lost.
 *         patience_ns: Maximum time for which the process may be without a supervisor.
 *   listen(endpoint, name, [authority], [certificate], [key], [token], [clock_limit_ns])
 *       Allows other hosts to join the system.
 *         endpoint: "tcp/HOST:PORT" or "tls/HOST:PORT".
 *         name: Name of this host.
 *         authority: File of the certificate authority that signs the other hosts' certificates.
 *         token: Secret that a host must present to join.
 *         clock_limit_ns: Maximum difference between the clocks.
 *   take_over() -> TakenOver
 *       Takes over processes that lost a system with this name, and continues everything that runs in them;
 *       the system must be opened with "adopt": true.
 *   source(processor, name, kind, priority, [period_ns], [virtual_cost_ns])
 *       Creates an interrupt source on a processor.
 *         kind: "timer", "trigger" or "software".
 *         period_ns: Period of a timer.
 *         virtual_cost_ns: Duration of a firing under the virtual clock.
 *   request(source)
 *       Requests one firing of a software source.
 *         source: "processor.source".
 *   physical_device(processor, name, kind, source, [options], [place]) -> PhysicalDevice
 *       Opens a device on a source. Returns its channels and parts.
 *         kind: Driver: "mujoco", "loopback", "scripted", ...
 *         options: Options of the driver.
 *   device_service(device, service, [arguments]) -> Value or null
 *       Calls an acyclic service of a device's driver. Returns the service's answer.
 *         service: Service declared by the driver, as listed by `configuration`.
 *         arguments: Arguments of the service.
 *   scan_devices(kind, [options]) -> Value or null
 *       Searches the host of the system for devices that a driver could open; does not move any machine.
 *       Returns a description of each device, and the options that open it.
 *         kind: Name of the driver.
 *         options: Options of the driver that define the search.
 *   device_served(errand) -> Value or null
 *       Waits for a service or search in progress. Returns its answer, but only once.
 *   reopen_physical_device(name)
 *       Reopens a lost device with all its bindings.
 *   delete_physical_device(name)
 *       Closes a device.
 *   raises(device, channel, source, [place])
 *       Makes a channel of a device raise a source.
 *   place(...placement)
 *       Sets the placement of blocks that are not placed otherwise: label pattern → source.
 * software
 *   download(path, [name], [python]) -> ModuleAbout
 *       Loads a code module. Returns its blocks.
 *         name: Name of the module; by default the name of the file.
 *         python: Interpreter that tests the module in a separate process.
 *   define_verb(...verb)
 *       Defines a verb.
 *   check_graph(...graph)
 *       Checks a data flow graph, and refuses it if it has mistakes. Does not define it.
 *   check_definition(...drawing) -> list of Refusal
 *       Returns all mistakes of a graph or a verb, each with its location in "where". Does not define it.
 *   check_drawing(...drawing) -> list of Refusal
 *       Returns all mistakes of a graph or a verb, as `check_definition` does, and everything that an
 *       installation would refuse regardless of the arguments: constants, defaults, members of objects,
 *       second writers in a list. Does not define it.
 *   compatible(from, [to], ...drawing) -> PortVerdicts
 *       Returns the reason why two ports of a graph or a verb cannot be wired together, or null if they can;
 *       without `to`, returns the reason for every other port.
 *   define_device_type(...device_type)
 *       Defines a type of logical devices.
 *   compose(...composition) -> Verb
 *       Returns the verb that a composition of verbs defines, without defining it in the system.
 *   svv(name, [place], ...specification)
 *       Creates an SVV.
 *   delete_svv(name)
 *       Deletes an SVV to which no port is bound.
 *   library() -> list of Interface
 *       Returns all blocks of the library and of code modules.
 *   fuse([on]) -> FusedBlocks
 *       Fuses C blocks that are always due together, for up to a second; call again as long as there are
 *       groups `waiting`. Returns the fused blocks.
 *         on: False to undo fusing.
 *   fused() -> FusedBlocks
 *       Returns the fused blocks, and the other blocks with the reasons.
 * logical devices
 *   device(name, ...request)
 *       Creates a logical device with its own verb instance.
 *   enable(name) -> integer
 *       Starts a device's own verb. Returns its instance, or 0 if there is none. The device is enabled when
 *       the verb is ready.
 *   wait_enabled(name, [timeout_ns], [until_ns]) -> boolean
 *       Waits until a device is enabled. Returns true if the device is enabled.
 *         timeout_ns: Timeout relative to the call, on the system's clock.
 *         until_ns: Absolute deadline, as an alternative to the timeout.
 *   disable(name)
 *       Ends the verbs that use a device, then the device's own verb, and waits until they have ended.
 *   exchange_verb(device, verb, [place])
 *       Replaces a device's own verb with another one, within one firing if the device is enabled.
 *   delete_device(name)
 *       Deletes a device.
 *   device_state(name) -> DeviceState
 *       Returns the state of a device: "disabled", "enabling", "standstill", "moving", "stopping" or "fault".
 *   device_parameter(name, parameter) -> Value
 *       Returns the value of a device parameter.
 *   set_device_parameter(name, parameter, value)
 *       Sets a device parameter.
 * arms
 *   describe_arm(...arm)
 *       Registers an arm, replacing any arm with the same name: its joints, and the geometry that connects
 *       them or the reason why it is unknown.
 *   arms() -> list of ArmDescription
 *       Returns the arms whose joints all exist.
 * taught points
 *   name_points(arm, path, model, joints, units, [any_model])
 *       Sets the file in which the taught points of an arm are stored; it is created when the first point is
 *       taught.
 *         model: Identifier of the arm's mechanical model, as stored in the file.
 *         joints: Short names of the joints.
 *         units: Unit of each joint, used if the file is created.
 *         any_model: True if points taught with other models are accepted as well.
 *   points(arm) -> TaughtPoints
 *       Reads the taught points of an arm from its file, with its frames and tools.
 *   teach_point(arm, point)
 *       Stores a taught point in the file of an arm, replacing any point with the same name.
 *   rename_point(arm, name, to)
 *       Renames a taught point; its position in the file is kept.
 *   delete_point(arm, name) -> TaughtPoint
 *       Removes a taught point and returns it.
 * verb instances
 *   check(...application) -> Plan
 *       Plans an application without creating an instance. Returns the plan.
 *   perform([limits], ...application) -> Report or null
 *       Calls a verb: creates an instance, starts it with the values of the application, waits until it has
 *       ended, and deletes it. Returns its end report.
 *   performed(instance) -> Report or null
 *       Continues a verb call: waits until its instance has ended, and deletes it. Returns its end report.
 *   create(...application) -> integer
 *       Creates an instance. Returns its number.
 *   start(instance, [values], [limits])
 *       Starts an instance.
 *         values: Input parameter → value.
 *   wait(instance, [timeout_ns], [until_ns]) -> Report or null
 *       Waits until an instance has ended. Returns its end report, or null after the timeout.
 *         timeout_ns: Timeout relative to the call, on the system's clock.
 *         until_ns: Absolute deadline, as an alternative to the timeout.
 *   halt(instance, [timeout_ns], [until_ns]) -> Report or null
 *       Ends an instance and waits until it has ended. First follows a transition on `halted`, if there is
 *       one; a second halt is immediate. Returns the end report.
 *         timeout_ns: Timeout relative to the call, on the system's clock.
 *         until_ns: Absolute deadline, as an alternative to the timeout.
 *   suspend(instance)
 *       Suspends an instance after its current step is complete.
 *   resume(instance)
 *       Resumes a suspended instance.
 *   delete(instance)
 *       Deletes an instance that has ended.
 *   state(instance) -> InstanceState
 *       Returns the state of an instance: "created", "queued", "running", "suspended", "ended" or "deleted".
 *   instance(instance) -> InstanceAbout
 *       Returns the name, verb, state, blocks, conditions and lists of an instance.
 *   report(instance) -> Report or null
 *       Returns the end report of the latest start; null while it is running.
 *   set(instance, [values], [every_ns])
 *       Sets tunable input parameters and intervals of a running instance.
 *         values: Input parameter → value.
 *         every_ns: Label of a block → interval.
 * values and time
 *   read(names, [raw]) -> Snapshot
 *       Returns one consistent snapshot.
 *         names: Names of SVVs, of private cells ("move#1:coefficients"), or of channels
 *         ("plant.elbow.position").
 *         raw: True to return "bytes", the memory of the C type in base64, little-endian, instead of "value",
 *         which cannot represent NaN or infinity in JSON.
 *   write(name, value)
 *       Stores a value.
 *   history(name, count, [raw]) -> list of Reading
 *       Returns the most recent values, oldest first.
 *         count: Maximum number of values.
 *         raw: True to return "bytes" instead of "value", as in `read`.
 *   svv_about(name) -> SvvAbout
 *       Returns the properties of an SVV, a private cell or a channel: its type, unit, history and writers.
 *   now() -> integer
 *       Returns the time on the system's clock, ns.
 *   advance(duration_ns)
 *       Runs the firings in (now, now + duration] under the virtual clock.
 *   step() -> boolean
 *       Runs the next firing under the virtual clock, however far ahead it is. Returns false if nothing will
 *       ever be due.
 * cell
 *   emergency_stop(reason)
 *       Stops everything that moves. The stop is latched until `reset` is called.
 *   emergency_stop_input(device, channel, [at_zero])
 *       Makes a channel of a device trip the emergency stop.
 *         at_zero: True if the channel trips the emergency stop at zero rather than at one.
 *   reset() -> map of text
 *       Resets the emergency stop, and reopens lost devices. Returns the devices that are still lost, with
 *       the reasons.
 *   pause([devices]) -> list of text
 *       Suspends all actions on these logical devices, or on all devices, and waits until they are suspended.
 *       Returns the names of the suspended instances.
 *   paused(instances, names) -> list of text
 *       Waits until these instances are no longer running. Returns their names.
 *   resume_program([devices]) -> list of text
 *       Ends a pause. Returns the names of the instances that resume or begin.
 *   mode() -> Mode
 *       Returns the mode: "automatic" or "manual".
 *   set_mode(mode)
 *       Changes the mode.
 *   enabling_switch(device, channel)
 *       Sets the channel of the enabling switch, without which nothing moves in manual mode.
 *   force(name, value, [who]) -> integer
 *       Forces a signal, identified by its logical device: an input has this value instead of its reading, an
 *       output instead of its command. The force ends with the session that set it, when the device is
 *       disabled or lost, and at an emergency stop; an alarm is active until then. Returns the number of the
 *       force.
 *         value: Value in the unit of the signal's channel.
 *         who: Person or session that forces the signal; set by the control interface to its caller.
 *   unforce([name], [who]) -> list of text
 *       Ends the forcing of one signal, or of all. Returns the signals that were forced.
 *         who: Person or session that releases the signal; set by the control interface to its caller.
 *   forced() -> map of ForcedSignal
 *       Returns the forced signals, by logical device.
 * alarms
 *   define_alarm(code, ...said)
 *       Defines the text of an alarm code.
 *   raise_alarm(code, [source], [text])
 *       Raises an alarm.
 *         source: Source of the alarm.
 *   clear_alarm(code, [source]) -> boolean
 *       Clears the cause of an alarm. Returns true if the alarm was active.
 *   alarms() -> Alarms
 *       Returns the current alarms, the shelved ones, and the history.
 *   acknowledge_alarms([number]) -> integer
 *       Acknowledges one alarm, or all alarms that are not shelved. Returns the number of newly acknowledged
 *       alarms.
 *   shelve_alarm(number, reason, for_ns, [who])
 *       Removes an alarm from the list for a limited time. Emergency stops, losses, and alarms of critical
 *       severity cannot be shelved.
 *         reason: Reason for the shelving.
 *         for_ns: Duration on the system's clock; at most 24 h.
 *         who: Person or session that shelves the alarm; set by the control interface to its caller.
 *   unshelve_alarm(number, [who]) -> boolean
 *       Puts a shelved alarm back into the list. Returns true if it was shelved.
 *         who: Person or session that unshelves the alarm; set by the control interface to its caller.
 *   restore_alarms(history)
 *       Restores the alarm history from an earlier run.
 * observation
 *   names() -> Names
 *       Returns the names of all items.
 *   configuration() -> Configuration
 *       Returns the processors, sources, devices as described by their drivers, and device types.
 *   installed() -> InstalledInstances
 *       Returns all instances with their blocks, ports, cells, command lists, conditions and transitions.
 *   verbs() -> list of VerbSummary
 *       Returns the defined verbs.
 *   verb_form(name) -> VerbForm
 *       Returns the contents of a form for starting a verb: its arguments and input parameters.
 *   geometry(device) -> Geometry
 *       Returns the bodies, joints, shapes and meshes of a physical device, for drawing.
 *   statistics() -> Statistics
 *       Returns run-time data of sources, instances and devices.
 *   probe(for_ns, [source])
 *       Starts a probe that measures the blocks of a source, or of all sources, one per firing; `statistics`
 *       then includes their durations.
 *         for_ns: Duration in real time, at most an hour.
 *   log([since]) -> list of LogEntry
 *       Returns the log: commands, conditions, faults, transitions and ends.
 *         since: Number of the first entry.
 * workspaces
 *   ship_workspace(...workspace)
 *       Adds a workspace supplied by a program, replacing any supplied workspace with the same name.
 *   withdraw_workspace(name)
 *       Removes a workspace supplied by a program.
 *   keep_workspace(...workspace)
 *       Saves a workspace for all users of the system. Cannot replace one supplied by a program.
 *   forget_workspace(name)
 *       Removes a workspace saved by a person.
 *   workspaces() -> list of WorkspaceAbout
 *       Returns one-line summaries of the workspaces.
 *   workspace(name) -> Workspace
 *       Returns the workspace with this name.
 *   check_workspace(...workspace) -> list of Refusal
 *       Returns all mistakes of a workspace in the current system: those in its structure, and references to
 *       missing items.
 * recordings
 *   record(path, [svvs], [cells], [replay], [split_bytes], [keep], [identity], [resumes]) -> RecordingBegun
 *       Starts recording to a new MCAP file. Returns the number of the recording.
 *         svvs: Names of SVVs, with * and ? as wildcards; all SVVs if omitted.
 *         cells: True to include the private cells of all verb instances.
 *         replay: True to include all external inputs, so that the run can be replayed.
 *         split_bytes: Approximate file size, bytes, at which the next file is started: run.mcap, run-2.mcap
 *         and so on. A recording for replay cannot be split.
 *         keep: Number of files to keep if the recording is split (the oldest is deleted); all if omitted.
 *         identity: Identity of the recording, stored in the metadata of its files. Over the control
 *         interface, it is set by the daemon.
 *         resumes: True to continue after the existing files at that path; those with this identity then
 *         count towards `keep`. Over the control interface, it is set by the daemon and must be omitted.
 *   recording(recording) -> RecordingSummary
 *       Returns the state of a recording.
 *   stop_recording(recording) -> RecordingSummary
 *       Ends a recording. Returns its state; if the recording has not ended yet, call again.
 *   replay(path, [trust], [present]) -> ReplayBegun
 *       Starts to replay a recording in a separate process, without affecting the system, and compares every
 *       value. Returns the number of the replay. Code modules in the recording run only if their SHA-256
 *       digests match modules that the system has loaded at some time, or are in `trust`.
 *         trust: Digests of code modules that may run. Over the control interface, they are set by the daemon
 *         and must be omitted.
 *         present: True to replace modules of the recording with the system's current modules of the same
 *         names; the first difference is then caused by them.
 *   replaying(replay) -> Replaying
 *       Returns the state of a replay.
 *   stop_replay(replay) -> Replaying
 *       Stops a replay at its current position and deletes it. Returns its final state.
 *   recordings([folder]) -> list of RecordingFile
 *       Returns the recordings in a folder, newest first.
 *         folder: Folder; over the control interface it is the daemon's own folder and must be omitted.
 *   recorded(path) -> RecordingContents
 *       Returns a description of a recording: its time span, its contents and its ends. If the recording is
 *       still in progress, the description covers the part that is on disk.
 *   recorded_at(path, time_ns, [names], [topics], [known]) -> RecordedAt
 *       Returns the state of a recording at a given time.
 *         time_ns: Time on the system's clock.
 *         names: Names of SVVs and cells.
 *         topics: Names of other channels, such as `/installed`, `/statistics`, `/alarms`.
 *         known: Times of the messages that the caller already has, by channel; these messages are omitted.
 *   recorded_messages(path, topic, [since]) -> RecordedMessages
 *       Returns messages of a channel that carries no values, such as `/log` or `/ends`.
 *         since: Number of the first message.
 *   recorded_span(path, names, from_ns, to_ns, columns, [since]) -> RecordedSpan
 *       Returns SVVs and cells over a span of a recording, condensed into columns, with exact sums.
 *         columns: Number of columns per channel, at most 10,000; the values within a column are condensed.
 *         since: `next` of the previous answer.
 *   recorded_firing(path, time_ns, [back]) -> integer or null
 *       Returns the time, in a recording, of the next (or previous) firing that stored a value; null if there
 *       is none.
 *         back: True for the previous firing.
 * ---- end of the calls ----
 *
 * A verb: {"name", "blocks": {label: {"block": {"subroutine": "library.pid"}, "constants": {}}}, "instantiation_parameters": {name: [ports]},
 * "cells", "input_parameters": {name: {"targets": [ports], "default"}}, "output_values": {name: port}, "command_lists": {name: {"commands":
 * [{"command": "activate", "block", "every_ns"}, ...]}}, "conditions": {name: {"on": [conditions], "returns": [outputs]}}, "transitions":
 * [{"from", "condition", "to"}], "modes"}.
 * An application: {"verb", "arguments": {name: {"svv": name} or {"channel": {"device", "channel"}} or {"device": name}}, "placement": {label:
 * source}}. In Python, Verb.json() shows the form of any verb. */

#ifdef __cplusplus
}
#endif

#endif
