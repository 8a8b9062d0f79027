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

/* The calls. Names of sources are "processor.source", times are ns; what stands in [brackets] may be left out.
 *
 * configuration
 *   processor              name, [core], [supervisor], [process] (true: one of its own; text: the one of that name), [host] (one that has joined),
 *                          [lost_after_ns] (of a process: how long it may stand still), [patience_ns] (of its supervisor: the same)
 *   listen                 endpoint ("tcp/HOST:PORT", "tls/HOST:PORT"), name, [authority], [certificate], [key], [token], [clock_limit_ns]
 *   take_over              -> what runs in processes that lost a system of this name goes on; the system is opened with "adopt": true
 *   source                 processor, name, kind ("timer", "trigger", "software"), [period_ns], priority, [virtual_cost_ns]
 *   request                source
 *   physical_device        processor, name, kind ("mujoco", "loopback", "scripted"), [options], source     -> its channels and parts
 *   reopen_physical_device name: one that was lost, with everything that is bound to it
 *   delete_physical_device name
 *   place                  {pattern: source, ...}
 * software
 *   download               path, [name], [python]                            -> the module's blocks
 *   define_verb            a verb        check_graph            a data flow graph        define_device_type     a logical device type
 *   check_definition       graph or verb -> all that is wrong with it, each with "where"; nothing is entered
 *   compatible             graph or verb, from, [to]: {"block", "port"} -> null or why they cannot be wired; without to: of every port
 *   svv                    name, type_text, [unit], [initial], [history], [types]
 *   delete_svv             name
 *   library                                                                 -> every block: of the library, of code modules
 * logical devices
 *   device                 name, device_type, [parameters], [arguments], [source]
 *   enable                 name -> its instance; wait_enabled: name, [timeout_ns] or [until_ns] -> bool; disable, delete_device, device_state: name
 *   device_parameter       name, parameter -> value;   set_device_parameter: name, parameter, value
 * verb instances
 *   check                  an application -> its plan;   create: an application -> the number of the instance
 *   start                  instance, [values], [limits]                     values: {input parameter: value}
 *   wait                   instance, [timeout_ns] or [until_ns] -> the end report, null after the timeout
 *   halt                   instance -> the end report;   suspend, resume, delete, state, instance, report: instance
 *   set                    instance, [values], [every_ns]                   tunable input parameters, tunable intervals {label: ns}
 * values and time
 *   read                   names, [raw] -> {"time_ns", "values": {name: {"value", "number", "time_ns"}}}, one consistent snapshot
 *   write                  name, value;   history: name, count, [raw];   svv_about: name;   raw: "bytes" in base64 instead of "value"
 *                          names are those of SVVs, of private cells, "move#1:coefficients", and of channels, "plant.elbow.position"
 *   now                    -> ns;   advance: duration_ns;   step -> bool
 * cell
 *   emergency_stop         reason;   emergency_stop_input: device, channel, [at_zero];   reset
 *   pause, resume_program  [devices] -> the instances that stop and go on;   paused: instances, names: waits until these have stopped
 *   mode                   -> "automatic" or "manual";   set_mode: mode;   enabling_switch: device, channel
 *   define_alarm           code, text, [remedy], [severity];   raise_alarm: code, [source], [text];   clear_alarm: code, [source]
 *   alarms                 -> all and their history;   acknowledge_alarms: [number];   restore_alarms: history
 *   raises                 device, channel, source      exchange_verb: device, verb      compose: a composition      verbs
 *   configuration          -> processors, sources, devices as their drivers describe them, device types
 *   installed              -> every instance with its blocks, ports, cells, command lists, conditions and transitions
 *   verb_form              name -> the arguments and input parameters of a verb;   geometry: device -> bodies, joints, shapes, meshes
 *   statistics, names      -> what there is and how it runs;   probe: [source], for_ns; then statistics tells how long blocks take;
 *     log: [since] -> commands, conditions, faults, transitions, ends
 *   record                 path, [svvs], [cells] -> {"recording"}, into a new MCAP file;   recording, stop_recording: recording -> how it stands
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
