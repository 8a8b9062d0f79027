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
 * ---- the calls, made from their declarations in crates/api ----
 * configuration
 *   processor(name, [core], [supervisor], [process], [host], [lost_after_ns], [patience_ns])
 *       Makes a real-time processor.
 *         core: The core that it is bound to.
 *         supervisor: true: the supervisor is there; if no processor says so, it is on the first one.
 *         process: true: in a process of its own; a text: in the process of that name.
 *         host: A host that has joined.
 *         lost_after_ns: Time for which a process may stand still until it counts as lost.
 *         patience_ns: Time for which a process may miss its supervisor.
 *   listen(endpoint, name, [authority], [certificate], [key], [token], [clock_limit_ns])
 *       Lets other hosts join.
 *         endpoint: "tcp/HOST:PORT" or "tls/HOST:PORT".
 *         name: The name of this host.
 *         authority: The file of the authority that signs the others' certificates.
 *         token: The text that a host must know to join.
 *         clock_limit_ns: Maximum difference of the clocks.
 *   take_over() -> TakenOver
 *       Lets go on what runs in processes that lost a system of this name; the system is opened with "adopt":
 *       true.
 *   source(processor, name, kind, priority, [period_ns], [virtual_cost_ns])
 *       Makes an interrupt source of a processor.
 *         kind: "timer", "trigger" or "software".
 *         period_ns: Period of a timer.
 *         virtual_cost_ns: Cost of a firing under the virtual clock.
 *   request(source)
 *       Requests a software source: it fires once.
 *         source: "processor.source".
 *   physical_device(processor, name, kind, source, [options], [place]) -> PhysicalDevice
 *       Opens a device for a source. Returns its channels and parts.
 *         kind: The driver: "mujoco", "loopback", "scripted", ...
 *         options: Options of the driver.
 *   device_service(device, service, [arguments]) -> Value or null
 *       Lets the driver of a device carry out a service, off the cycle. Returns what that answers.
 *         service: Service that the driver declares: `configuration` lists them.
 *         arguments: Arguments of the service.
 *   scan_devices(kind, [options]) -> Value or null
 *       Looks on the host of the system for devices that a driver could open; nothing moves. Returns what
 *       each is, and the options that open it.
 *         kind: The driver.
 *         options: Options of the driver that say where to look.
 *   device_served(errand) -> Value or null
 *       Waits for a service or a search that goes on. Returns what it answers, once.
 *   reopen_physical_device(name)
 *       Opens a device that was lost again, with everything that is bound to it.
 *   delete_physical_device(name)
 *       Closes a device.
 *   raises(device, channel, source, [place])
 *       Lets a channel of a device request a source.
 *   place(...placement)
 *       Says on which sources blocks run that nothing else places: source by pattern of labels.
 * software
 *   download(path, [name], [python]) -> ModuleAbout
 *       Loads a code module. Returns its blocks.
 *         name: Name of the module; by default the name of the file.
 *         python: The interpreter that tries it in a process of its own.
 *   define_verb(...verb)
 *       Enters a verb.
 *   check_graph(...graph)
 *       Refuses a data flow graph that is wrong; nothing is entered.
 *   check_definition(...drawing) -> list of Refusal
 *       Returns all that is wrong with a graph or a verb, each with "where"; nothing is entered.
 *   check_drawing(...drawing) -> list of Refusal
 *       Returns all that is wrong with a graph or a verb, as `check_definition` does, and what installing it
 *       would refuse whatever it is given: constants, defaults, members of objects, second writers in a list.
 *       Nothing is entered.
 *   compatible(from, [to], ...drawing) -> PortVerdicts
 *       Returns why two ports of a graph or a verb cannot be wired, or null; without `to`, why each other one
 *       cannot.
 *   define_device_type(...device_type)
 *       Enters a type of logical devices.
 *   compose(...composition) -> Verb
 *       Returns the verb that a composition of verbs is; nothing is entered.
 *   svv(name, [place], ...specification)
 *       Makes an SVV.
 *   delete_svv(name)
 *       Deletes an SVV that nothing is bound to.
 *   library() -> list of Interface
 *       Returns every block: of the library, of code modules.
 *   fuse([on]) -> FusedBlocks
 *       Fuses blocks in C that are always due together, for a second; with groups `waiting` it is to be
 *       called again. Returns what is fused.
 *         on: False undoes it.
 *   fused() -> FusedBlocks
 *       Returns what is fused, and what is not and why.
 * logical devices
 *   device(name, ...request)
 *       Makes a logical device, with its own verb instance.
 *   enable(name) -> integer
 *       Starts the verb that keeps a device going. Returns that instance, 0 where there is none. It is
 *       enabled when it is ready.
 *   wait_enabled(name, [timeout_ns], [until_ns]) -> boolean
 *       Waits until a device is enabled. Returns whether it is.
 *         timeout_ns: Time limit from now, on the system's clock.
 *         until_ns: Time of the limit, instead.
 *   disable(name)
 *       Ends the verbs that use a device, then its own; waits until that is done.
 *   exchange_verb(device, verb, [place])
 *       Replaces the verb that keeps a device going by another one, within one firing where it is enabled.
 *   delete_device(name)
 *       Deletes a device.
 *   device_state(name) -> DeviceState
 *       Returns "disabled", "enabling", "standstill", "moving", "stopping" or "fault".
 *   device_parameter(name, parameter) -> Value
 *       Returns the value of a parameter.
 *   set_device_parameter(name, parameter, value)
 *       Sets a parameter.
 * arms
 *   describe_arm(...arm)
 *       Enters an arm, in the place of the one of that name: its joints, and the geometry that joins them or
 *       the reason why it is not known.
 *   arms() -> list of ArmDescription
 *       Returns the arms whose joints are there.
 * taught points
 *   name_points(arm, path, model, joints, units, [any_model])
 *       Says in which file the taught points of an arm are kept; the first point makes it.
 *         model: Identifier of the mechanics of the arm, which the file says.
 *         joints: Joints by their short names.
 *         units: Unit of each of them in a file that is made.
 *         any_model: true: the points of another model count too.
 *   points(arm) -> TaughtPoints
 *       Returns the taught points of an arm as its file has them now, with its frames and tools.
 *   teach_point(arm, point)
 *       Enters a taught point into the file of an arm, in the place of the one of that name.
 *   rename_point(arm, name, to)
 *       Gives a taught point another name; it keeps its place.
 *   delete_point(arm, name) -> TaughtPoint
 *       Removes a taught point, and returns it.
 * verb instances
 *   check(...application) -> Plan
 *       Plans an application without making anything. Returns the plan.
 *   perform([limits], ...application) -> Report or null
 *       Calls a verb: makes an instance, starts it with the values of the application, waits until it has
 *       ended and deletes it. Returns its end report.
 *   performed(instance) -> Report or null
 *       Goes on with the call of a verb: waits until its instance has ended and deletes it. Returns its end
 *       report.
 *   create(...application) -> integer
 *       Makes an instance. Returns its number.
 *   start(instance, [values], [limits])
 *       Starts an instance.
 *         values: Input parameter to value.
 *   wait(instance, [timeout_ns], [until_ns]) -> Report or null
 *       Waits until an instance has ended. Returns its end report, null after the timeout.
 *         timeout_ns: Time limit from now, on the system's clock.
 *         until_ns: Time of the limit, instead.
 *   halt(instance, [timeout_ns], [until_ns]) -> Report or null
 *       Ends an instance and waits until it has ended: a transition on `halted` may lie between, a second
 *       halt is immediate. Returns its end report.
 *         timeout_ns: Time limit from now, on the system's clock.
 *         until_ns: Time of the limit, instead.
 *   suspend(instance)
 *       Lets what an instance is doing run dry, then holds it.
 *   resume(instance)
 *       Lets a suspended instance go on.
 *   delete(instance)
 *       Deletes an instance that has ended.
 *   state(instance) -> InstanceState
 *       Returns "created", "queued", "running", "suspended", "ended" or "deleted".
 *   instance(instance) -> InstanceAbout
 *       Returns what an instance is: its name, verb, state, blocks, conditions and lists.
 *   report(instance) -> Report or null
 *       Returns the end report of the latest start, null while it lasts.
 *   set(instance, [values], [every_ns])
 *       Sets tunable input parameters and intervals of a running instance.
 *         values: Input parameter to value.
 *         every_ns: Label of a block to interval.
 * values and time
 *   read(names, [raw]) -> Snapshot
 *       Returns one consistent snapshot.
 *         names: Names of SVVs, of private cells, "move#1:coefficients", and of channels,
 *         "plant.elbow.position".
 *         raw: Instead of "value", which cannot say NaN or infinity in JSON: "bytes", the memory of the C
 *         type in base64, little endian.
 *   write(name, value)
 *       Stores a value.
 *   history(name, count, [raw]) -> list of Reading
 *       Returns the last values, oldest first.
 *         count: Maximum number of values.
 *         raw: "bytes" instead of "value", as of `read`.
 *   svv_about(name) -> SvvAbout
 *       Returns what is known of an SVV, a private cell or a channel: its type, unit, history, writers.
 *   now() -> integer
 *       Returns the time of the system, ns.
 *   advance(duration_ns)
 *       Under the virtual clock: runs the firings in (now, now + duration].
 *   step() -> boolean
 *       Under the virtual clock: runs the next firing, whenever that is. Returns false where nothing is ever
 *       going to happen.
 * cell
 *   emergency_stop(reason)
 *       Stops everything that moves, until `reset`.
 *   emergency_stop_input(device, channel, [at_zero])
 *       Lets a channel of a device stop everything that moves.
 *         at_zero: True if it stops at zero, not at one.
 *   reset() -> map of text
 *       Ends the emergency stop, and opens devices again that were lost. Returns those that are lost still,
 *       each with why.
 *   pause([devices]) -> list of text
 *       Suspends what is done with these logical devices, or with all, and waits until it is. Returns the
 *       names of these instances.
 *   paused(instances, names) -> list of text
 *       Waits until these instances have stopped. Returns their names.
 *   resume_program([devices]) -> list of text
 *       Takes a pause back. Returns the names of the instances that go on or begin.
 *   mode() -> Mode
 *       Returns "automatic" or "manual".
 *   set_mode(mode)
 *       Changes the mode.
 *   enabling_switch(device, channel)
 *       Names the channel of the enabling switch, without which nothing moves in manual mode.
 * alarms
 *   define_alarm(code, ...said)
 *       Says what the alarms of a code mean.
 *   raise_alarm(code, [source], [text])
 *       Raises an alarm.
 *         source: Source of the alarm.
 *   clear_alarm(code, [source]) -> boolean
 *       Says that the cause of an alarm is gone. Returns whether there was one.
 *   alarms() -> Alarms
 *       Returns all alarms, those that are shelved, and their history.
 *   acknowledge_alarms([number]) -> integer
 *       Acknowledges one alarm, or all that are not shelved. Returns how many.
 *   shelve_alarm(number, reason, for_ns, [who])
 *       Takes an alarm out of the list for a time. Emergency stops, what is lost, and the severity critical
 *       stay in it.
 *         reason: Reason for it.
 *         for_ns: Duration on the system's clock: 24 h at most.
 *         who: Person or session that shelves it: the control interface enters its caller.
 *   unshelve_alarm(number, [who]) -> boolean
 *       Puts a shelved alarm back into the list. Returns whether it was shelved.
 *         who: Person or session that does it: the control interface enters its caller.
 *   restore_alarms(history)
 *       Enters the history of an earlier life.
 * observation
 *   names() -> Names
 *       Returns the names of what there is.
 *   configuration() -> Configuration
 *       Returns processors, sources, devices as their drivers describe them, device types.
 *   installed() -> InstalledInstances
 *       Returns every instance with its blocks, ports, cells, command lists, conditions and transitions.
 *   verbs() -> list of VerbSummary
 *       Returns the verbs that are entered.
 *   verb_form(name) -> VerbForm
 *       Returns what a form that starts a verb needs: its arguments and input parameters.
 *   geometry(device) -> Geometry
 *       Returns the bodies, joints, shapes and meshes of a physical device, for drawing.
 *   statistics() -> Statistics
 *       Returns how sources, instances and devices run.
 *   probe(for_ns, [source])
 *       Visits the blocks of a source, or of all, one a firing: then `statistics` tells how long they take.
 *         for_ns: Amount of real time, an hour at most.
 *   log([since]) -> list of LogEntry
 *       Returns commands, conditions, faults, transitions and ends.
 *         since: The number of the first one.
 * workspaces
 *   ship_workspace(...workspace)
 *       Enters a workspace that a program ships, in the place of the one that it shipped before under that
 *       name.
 *   withdraw_workspace(name)
 *       Removes a workspace that a program has shipped.
 *   keep_workspace(...workspace)
 *       Keeps a workspace for all who look at the system. One that a program has shipped is not replaced.
 *   forget_workspace(name)
 *       Removes a workspace that a person keeps.
 *   workspaces() -> list of WorkspaceAbout
 *       Returns the workspaces, each in one line.
 *   workspace(name) -> Workspace
 *       Returns a workspace.
 *   check_workspace(...workspace) -> list of Refusal
 *       Returns all that is wrong with a workspace here and now: its form, and what it names and is not
 *       there.
 * recordings
 *   record(path, [svvs], [cells], [replay], [split_bytes], [keep], [identity], [resumes]) -> RecordingBegun
 *       Begins to record into a new MCAP file. Returns its number.
 *         svvs: Names of SVVs, with * and ?; all where they are left out.
 *         cells: The private cells of all verb instances too.
 *         replay: Everything that comes from outside too, so that the run can be run again.
 *         split_bytes: Bytes of a file, about, from which on the next one begins: run.mcap, run-2.mcap and so
 *         on. A recording for a replay has none.
 *         keep: Files that stay where the recording is split; the oldest goes. All where it is left out.
 *         identity: Identity of the recording, which its files have in their metadata. Over the control
 *         interface the daemon gives it one.
 *         resumes: true: goes on behind the files of that path that are there, and those of this identity
 *         count for `keep`. Over the control interface it is the daemon's own, and is left out.
 *   recording(recording) -> RecordingSummary
 *       Returns how a recording stands.
 *   stop_recording(recording) -> RecordingSummary
 *       Ends a recording. Returns how it stands; where it still runs, it is to be called again.
 *   replay(path, [trust], [present]) -> ReplayBegun
 *       Begins to run a recording again, in a process of its own beside the system, which it does not touch,
 *       and compares every value. Returns its number. Code modules that the recording brings run only where
 *       their SHA-256 digests are those of modules that the system has had, or are in `trust`.
 *         trust: Digests of code modules that may run. Over the control interface they are the daemon's own,
 *         and are left out.
 *         present: true: the modules of the same names that the system has now take the place of the
 *         recording's; then the first difference is of them.
 *   replaying(replay) -> Replaying
 *       Returns how a replay stands.
 *   stop_replay(replay) -> Replaying
 *       Ends a replay where it is, and forgets it. Returns how it stood.
 *   recordings([folder]) -> list of RecordingFile
 *       Returns the recordings of a folder, the newest first.
 *         folder: Over the control interface it is the daemon's own, and is left out.
 *   recorded(path) -> RecordingContents
 *       Returns what a recording is: when, of what, how it ended. One that is under way is told as far as it
 *       is on the disk.
 *   recorded_at(path, time_ns, [names], [topics], [known]) -> RecordedAt
 *       Returns what was at a time of a recording.
 *         time_ns: Time on the system's clock.
 *         names: Names of SVVs and cells.
 *         topics: Names of other channels, `/installed`, `/statistics`, `/alarms`, …
 *         known: Times of the messages that the caller has, by channel: they are not told again.
 *   recorded_messages(path, topic, [since]) -> RecordedMessages
 *       Returns messages of a channel that has no values, `/log`, `/ends`, …
 *         since: The number of the first one.
 *   recorded_span(path, names, from_ns, to_ns, columns, [since]) -> RecordedSpan
 *       Returns SVVs and cells over a span of a recording, drawn together into columns, with exact sums.
 *         columns: Columns of each channel, at most 10,000: as many values as lie in one are drawn together.
 *         since: The `next` of the part before.
 *   recorded_firing(path, time_ns, [back]) -> integer or null
 *       Returns the time of the next firing of a recording that stored a value, or of the one before; null
 *       where there is none.
 *         back: The one before.
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
