# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501
"""Calls on a real-time system, generated from their declarations in crates/api: do not edit.

Calls that move bytes at a rate have their own methods, see `realtime.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .call_transport import CallTransport

LASTING = frozenset({"device_service", "scan_devices", "device_served", "wait_enabled", "disable", "perform", "performed", "wait", "halt", "advance", "pause", "paused"})
"""Calls that may last, and continue in slices."""


class Calls(CallTransport):
    """Every call as a method. An argument that is None is omitted."""

    __slots__ = ()

    def processor(self, name: str, core: int | None = None, supervisor: bool | None = None, process: Any = None, host: str | None = None, lost_after_ns: int | None = None, patience_ns: int | None = None) -> None:
        """Creates a real-time processor."""
        return self._ask("processor", {"name": name, "core": core, "supervisor": supervisor, "process": process, "host": host, "lost_after_ns": lost_after_ns, "patience_ns": patience_ns})

    def listen(self, endpoint: str, name: str, authority: str | None = None, certificate: str | None = None, key: str | None = None, token: str | None = None, clock_limit_ns: int | None = None) -> None:
        """Allows other hosts to join the system."""
        return self._ask("listen", {"endpoint": endpoint, "name": name, "authority": authority, "certificate": certificate, "key": key, "token": token, "clock_limit_ns": clock_limit_ns})

    def take_over(self) -> Any:
        """Takes over processes that lost a system with this name, and continues everything that runs in them;
        the system must be opened with "adopt": true."""
        return self._ask("take_over")

    def source(self, processor: str, name: str, kind: str, priority: int, period_ns: int | None = None, virtual_cost_ns: int | None = None) -> None:
        """Creates an interrupt source on a processor."""
        return self._ask("source", {"processor": processor, "name": name, "kind": kind, "priority": priority, "period_ns": period_ns, "virtual_cost_ns": virtual_cost_ns})

    def request(self, source: str) -> None:
        """Requests one firing of a software source."""
        return self._ask("request", {"source": source})

    def physical_device(self, processor: str, name: str, kind: str, source: str, options: dict[str, Any] | None = None, place: Any = None) -> Any:
        """Opens a device on a source. Returns its channels and parts."""
        return self._ask("physical_device", {"processor": processor, "name": name, "kind": kind, "source": source, "options": options, "place": place})

    def device_service(self, device: str, service: str, arguments: dict[str, Any] | None = None) -> Any:
        """Calls an acyclic service of a device's driver. Returns the service's answer."""
        return self._ask("device_service", {"device": device, "service": service, "arguments": arguments})

    def scan_devices(self, kind: str, options: dict[str, Any] | None = None) -> Any:
        """Searches the host of the system for devices that a driver could open; does not move any machine.
        Returns a description of each device, and the options that open it."""
        return self._ask("scan_devices", {"kind": kind, "options": options})

    def device_served(self, errand: int) -> Any:
        """Waits for a service or search in progress. Returns its answer, but only once."""
        return self._ask("device_served", {"errand": errand})

    def reopen_physical_device(self, name: str) -> None:
        """Reopens a lost device with all its bindings."""
        return self._ask("reopen_physical_device", {"name": name})

    def delete_physical_device(self, name: str) -> None:
        """Closes a device."""
        return self._ask("delete_physical_device", {"name": name})

    def raises(self, device: str, channel: str, source: str, place: Any = None) -> None:
        """Makes a channel of a device raise a source."""
        return self._ask("raises", {"device": device, "channel": channel, "source": source, "place": place})

    def place(self, placement: Mapping[str, Any]) -> None:
        """Sets the placement of blocks that are not placed otherwise: label pattern → source."""
        return self._ask_of("place", placement)

    def download(self, path: str, name: str | None = None, python: str | None = None) -> Any:
        """Loads a code module. Returns its blocks."""
        return self._ask("download", {"path": path, "name": name, "python": python})

    def define_verb(self, verb: Mapping[str, Any]) -> None:
        """Defines a verb."""
        return self._ask_of("define_verb", verb)

    def check_graph(self, graph: Mapping[str, Any]) -> None:
        """Checks a data flow graph, and refuses it if it has mistakes. Does not define it."""
        return self._ask_of("check_graph", graph)

    def check_definition(self, drawing: Mapping[str, Any]) -> list[Any]:
        """Returns all mistakes of a graph or a verb, each with its location in "where". Does not define
        it."""
        return self._ask_of("check_definition", drawing)

    def check_drawing(self, drawing: Mapping[str, Any]) -> list[Any]:
        """Returns all mistakes of a graph or a verb, as `check_definition` does, and everything that an
        installation would refuse regardless of the arguments: constants, defaults, members of objects, second
        writers in a list. Does not define it."""
        return self._ask_of("check_drawing", drawing)

    def compatible(self, drawing: Mapping[str, Any], from_: Any, to: Any = None) -> Any:
        """Returns the reason why two ports of a graph or a verb cannot be wired together, or null if they
        can; without `to`, returns the reason for every other port."""
        return self._ask_of("compatible", drawing, {"from": from_, "to": to})

    def define_device_type(self, device_type: Mapping[str, Any]) -> None:
        """Defines a type of logical devices."""
        return self._ask_of("define_device_type", device_type)

    def compose(self, composition: Mapping[str, Any]) -> Any:
        """Returns the verb that a composition of verbs defines, without defining it in the system."""
        return self._ask_of("compose", composition)

    def svv(self, specification: Mapping[str, Any], name: str, place: Any = None) -> None:
        """Creates an SVV."""
        return self._ask_of("svv", specification, {"name": name, "place": place})

    def delete_svv(self, name: str) -> None:
        """Deletes an SVV to which no port is bound."""
        return self._ask("delete_svv", {"name": name})

    def library(self) -> list[Any]:
        """Returns all blocks of the library and of code modules."""
        return self._ask("library")

    def fuse(self, on: bool | None = None) -> Any:
        """Fuses C blocks that are always due together, for up to a second; call again as long as there are
        groups `waiting`. Returns the fused blocks."""
        return self._ask("fuse", {"on": on})

    def fused(self) -> Any:
        """Returns the fused blocks, and the other blocks with the reasons."""
        return self._ask("fused")

    def device(self, request: Mapping[str, Any], name: str) -> None:
        """Creates a logical device with its own verb instance."""
        return self._ask_of("device", request, {"name": name})

    def enable(self, name: str) -> int:
        """Starts a device's own verb. Returns its instance, or 0 if there is none. The device is enabled when
        the verb is ready."""
        return self._ask("enable", {"name": name})

    def wait_enabled(self, name: str, timeout_ns: int | None = None, until_ns: int | None = None) -> bool:
        """Waits until a device is enabled. Returns true if the device is enabled."""
        return self._ask("wait_enabled", {"name": name, "timeout_ns": timeout_ns, "until_ns": until_ns})

    def disable(self, name: str) -> None:
        """Ends the verbs that use a device, then the device's own verb, and waits until they have ended."""
        return self._ask("disable", {"name": name})

    def exchange_verb(self, device: str, verb: str, place: Any = None) -> None:
        """Replaces a device's own verb with another one, within one firing if the device is enabled."""
        return self._ask("exchange_verb", {"device": device, "verb": verb, "place": place})

    def delete_device(self, name: str) -> None:
        """Deletes a device."""
        return self._ask("delete_device", {"name": name})

    def device_state(self, name: str) -> Any:
        """Returns the state of a device: "disabled", "enabling", "standstill", "moving", "stopping" or
        "fault"."""
        return self._ask("device_state", {"name": name})

    def device_parameter(self, name: str, parameter: str) -> Any:
        """Returns the value of a device parameter."""
        return self._ask("device_parameter", {"name": name, "parameter": parameter})

    def set_device_parameter(self, name: str, parameter: str, value: Any) -> None:
        """Sets a device parameter."""
        return self._ask("set_device_parameter", {"name": name, "parameter": parameter, "value": value})

    def describe_arm(self, arm: Mapping[str, Any]) -> None:
        """Registers an arm, replacing any arm with the same name: its joints, and the geometry that connects
        them or the reason why it is unknown."""
        return self._ask_of("describe_arm", arm)

    def arms(self) -> list[Any]:
        """Returns the arms whose joints all exist."""
        return self._ask("arms")

    def name_points(self, arm: str, path: str, model: str, joints: list[str], units: list[str], any_model: bool | None = None) -> None:
        """Sets the file in which the taught points of an arm are stored; it is created when the first point
        is taught."""
        return self._ask("name_points", {"arm": arm, "path": path, "model": model, "joints": joints, "units": units, "any_model": any_model})

    def points(self, arm: str) -> Any:
        """Reads the taught points of an arm from its file, with its frames and tools."""
        return self._ask("points", {"arm": arm})

    def teach_point(self, arm: str, point: Any) -> None:
        """Stores a taught point in the file of an arm, replacing any point with the same name."""
        return self._ask("teach_point", {"arm": arm, "point": point})

    def rename_point(self, arm: str, name: str, to: str) -> None:
        """Renames a taught point; its position in the file is kept."""
        return self._ask("rename_point", {"arm": arm, "name": name, "to": to})

    def delete_point(self, arm: str, name: str) -> Any:
        """Removes a taught point and returns it."""
        return self._ask("delete_point", {"arm": arm, "name": name})

    def check(self, application: Mapping[str, Any]) -> Any:
        """Plans an application without creating an instance. Returns the plan."""
        return self._ask_of("check", application)

    def perform(self, application: Mapping[str, Any], limits: Any = None) -> Any:
        """Calls a verb: creates an instance, starts it with the values of the application, waits until it has
        ended, and deletes it. Returns its end report."""
        return self._ask_of("perform", application, {"limits": limits})

    def performed(self, instance: int) -> Any:
        """Continues a verb call: waits until its instance has ended, and deletes it. Returns its end
        report."""
        return self._ask("performed", {"instance": instance})

    def create(self, application: Mapping[str, Any]) -> int:
        """Creates an instance. Returns its number."""
        return self._ask_of("create", application)

    def start(self, instance: int, values: dict[str, Any] | None = None, limits: Any = None) -> None:
        """Starts an instance."""
        return self._ask("start", {"instance": instance, "values": values, "limits": limits})

    def wait(self, instance: int, timeout_ns: int | None = None, until_ns: int | None = None) -> Any:
        """Waits until an instance has ended. Returns its end report, or null after the timeout."""
        return self._ask("wait", {"instance": instance, "timeout_ns": timeout_ns, "until_ns": until_ns})

    def halt(self, instance: int, timeout_ns: int | None = None, until_ns: int | None = None) -> Any:
        """Ends an instance and waits until it has ended. First follows a transition on `halted`, if there is
        one; a second halt is immediate. Returns the end report."""
        return self._ask("halt", {"instance": instance, "timeout_ns": timeout_ns, "until_ns": until_ns})

    def suspend(self, instance: int) -> None:
        """Suspends an instance after its current step is complete."""
        return self._ask("suspend", {"instance": instance})

    def resume(self, instance: int) -> None:
        """Resumes a suspended instance."""
        return self._ask("resume", {"instance": instance})

    def delete(self, instance: int) -> None:
        """Deletes an instance that has ended."""
        return self._ask("delete", {"instance": instance})

    def state(self, instance: int) -> Any:
        """Returns the state of an instance: "created", "queued", "running", "suspended", "ended" or
        "deleted"."""
        return self._ask("state", {"instance": instance})

    def instance(self, instance: int) -> Any:
        """Returns the name, verb, state, blocks, conditions and lists of an instance."""
        return self._ask("instance", {"instance": instance})

    def report(self, instance: int) -> Any:
        """Returns the end report of the latest start; null while it is running."""
        return self._ask("report", {"instance": instance})

    def set(self, instance: int, values: dict[str, Any] | None = None, every_ns: dict[str, Any] | None = None) -> None:
        """Sets tunable input parameters and intervals of a running instance."""
        return self._ask("set", {"instance": instance, "values": values, "every_ns": every_ns})

    def write(self, name: str, value: Any) -> None:
        """Stores a value."""
        return self._ask("write", {"name": name, "value": value})

    def svv_about(self, name: str) -> Any:
        """Returns the properties of an SVV, a private cell or a channel: its type, unit, history and
        writers."""
        return self._ask("svv_about", {"name": name})

    def now(self) -> int:
        """Returns the time on the system's clock, ns."""
        return self._ask("now")

    def advance(self, duration_ns: int) -> None:
        """Runs the firings in (now, now + duration] under the virtual clock."""
        return self._ask("advance", {"duration_ns": duration_ns})

    def step(self) -> bool:
        """Runs the next firing under the virtual clock, however far ahead it is. Returns false if nothing
        will ever be due."""
        return self._ask("step")

    def emergency_stop(self, reason: str) -> None:
        """Stops everything that moves. The stop is latched until `reset` is called."""
        return self._ask("emergency_stop", {"reason": reason})

    def emergency_stop_input(self, device: str, channel: str, at_zero: bool | None = None) -> None:
        """Makes a channel of a device trip the emergency stop."""
        return self._ask("emergency_stop_input", {"device": device, "channel": channel, "at_zero": at_zero})

    def reset(self) -> dict[str, Any]:
        """Resets the emergency stop, and reopens lost devices. Returns the devices that are still lost, with
        the reasons."""
        return self._ask("reset")

    def pause(self, devices: list[str] | None = None) -> list[str]:
        """Suspends all actions on these logical devices, or on all devices, and waits until they are
        suspended. Returns the names of the suspended instances."""
        return self._ask("pause", {"devices": devices})

    def paused(self, instances: list[int], names: list[str]) -> list[str]:
        """Waits until these instances are no longer running. Returns their names."""
        return self._ask("paused", {"instances": instances, "names": names})

    def resume_program(self, devices: list[str] | None = None) -> list[str]:
        """Ends a pause. Returns the names of the instances that resume or begin."""
        return self._ask("resume_program", {"devices": devices})

    def mode(self) -> Any:
        """Returns the mode: "automatic" or "manual"."""
        return self._ask("mode")

    def set_mode(self, mode: Any) -> None:
        """Changes the mode."""
        return self._ask("set_mode", {"mode": mode})

    def enabling_switch(self, device: str, channel: str) -> None:
        """Sets the channel of the enabling switch, without which nothing moves in manual mode."""
        return self._ask("enabling_switch", {"device": device, "channel": channel})

    def force(self, name: str, value: Any, who: str | None = None) -> int:
        """Forces a signal, identified by its logical device: an input has this value instead of its reading,
        an output instead of its command. The force ends with the session that set it, when the device is
        disabled or lost, and at an emergency stop; an alarm is active until then. Returns the number of the
        force."""
        return self._ask("force", {"name": name, "value": value, "who": who})

    def unforce(self, name: str | None = None, who: str | None = None) -> list[str]:
        """Ends the forcing of one signal, or of all. Returns the signals that were forced."""
        return self._ask("unforce", {"name": name, "who": who})

    def forced(self) -> dict[str, Any]:
        """Returns the forced signals, by logical device."""
        return self._ask("forced")

    def define_alarm(self, said: Mapping[str, Any], code: str) -> None:
        """Defines the text of an alarm code."""
        return self._ask_of("define_alarm", said, {"code": code})

    def raise_alarm(self, code: str, source: str | None = None, text: str | None = None) -> None:
        """Raises an alarm."""
        return self._ask("raise_alarm", {"code": code, "source": source, "text": text})

    def clear_alarm(self, code: str, source: str | None = None) -> bool:
        """Clears the cause of an alarm. Returns true if the alarm was active."""
        return self._ask("clear_alarm", {"code": code, "source": source})

    def alarms(self) -> Any:
        """Returns the current alarms, the shelved ones, and the history."""
        return self._ask("alarms")

    def acknowledge_alarms(self, number: int | None = None) -> int:
        """Acknowledges one alarm, or all alarms that are not shelved. Returns the number of newly
        acknowledged alarms."""
        return self._ask("acknowledge_alarms", {"number": number})

    def shelve_alarm(self, number: int, reason: str, for_ns: int, who: str | None = None) -> None:
        """Removes an alarm from the list for a limited time. Emergency stops, losses, and alarms of critical
        severity cannot be shelved."""
        return self._ask("shelve_alarm", {"number": number, "reason": reason, "for_ns": for_ns, "who": who})

    def unshelve_alarm(self, number: int, who: str | None = None) -> bool:
        """Puts a shelved alarm back into the list. Returns true if it was shelved."""
        return self._ask("unshelve_alarm", {"number": number, "who": who})

    def restore_alarms(self, history: list[Any]) -> None:
        """Restores the alarm history from an earlier run."""
        return self._ask("restore_alarms", {"history": history})

    def names(self) -> Any:
        """Returns the names of all items."""
        return self._ask("names")

    def configuration(self) -> Any:
        """Returns the processors, sources, devices as described by their drivers, and device types."""
        return self._ask("configuration")

    def installed(self) -> Any:
        """Returns all instances with their blocks, ports, cells, command lists, conditions and
        transitions."""
        return self._ask("installed")

    def verbs(self) -> list[Any]:
        """Returns the defined verbs."""
        return self._ask("verbs")

    def verb_form(self, name: str) -> Any:
        """Returns the contents of a form for starting a verb: its arguments and input parameters."""
        return self._ask("verb_form", {"name": name})

    def geometry(self, device: str) -> Any:
        """Returns the bodies, joints, shapes and meshes of a physical device, for drawing."""
        return self._ask("geometry", {"device": device})

    def statistics(self) -> Any:
        """Returns run-time data of sources, instances and devices."""
        return self._ask("statistics")

    def probe(self, for_ns: int, source: str | None = None) -> None:
        """Starts a probe that measures the blocks of a source, or of all sources, one per firing;
        `statistics` then includes their durations."""
        return self._ask("probe", {"for_ns": for_ns, "source": source})

    def log(self, since: int | None = None) -> list[Any]:
        """Returns the log: commands, conditions, faults, transitions and ends."""
        return self._ask("log", {"since": since})

    def ship_workspace(self, workspace: Mapping[str, Any]) -> None:
        """Adds a workspace supplied by a program, replacing any supplied workspace with the same name."""
        return self._ask_of("ship_workspace", workspace)

    def withdraw_workspace(self, name: str) -> None:
        """Removes a workspace supplied by a program."""
        return self._ask("withdraw_workspace", {"name": name})

    def keep_workspace(self, workspace: Mapping[str, Any]) -> None:
        """Saves a workspace for all users of the system. Cannot replace one supplied by a program."""
        return self._ask_of("keep_workspace", workspace)

    def forget_workspace(self, name: str) -> None:
        """Removes a workspace saved by a person."""
        return self._ask("forget_workspace", {"name": name})

    def workspaces(self) -> list[Any]:
        """Returns one-line summaries of the workspaces."""
        return self._ask("workspaces")

    def workspace(self, name: str) -> Any:
        """Returns the workspace with this name."""
        return self._ask("workspace", {"name": name})

    def check_workspace(self, workspace: Mapping[str, Any]) -> list[Any]:
        """Returns all mistakes of a workspace in the current system: those in its structure, and references
        to missing items."""
        return self._ask_of("check_workspace", workspace)

    def record(self, path: str, svvs: list[str] | None = None, cells: bool | None = None, replay: bool | None = None, split_bytes: int | None = None, keep: int | None = None, identity: str | None = None, resumes: bool | None = None) -> Any:
        """Starts recording to a new MCAP file. Returns the number of the recording."""
        return self._ask("record", {"path": path, "svvs": svvs, "cells": cells, "replay": replay, "split_bytes": split_bytes, "keep": keep, "identity": identity, "resumes": resumes})

    def recording(self, recording: int) -> Any:
        """Returns the state of a recording."""
        return self._ask("recording", {"recording": recording})

    def stop_recording(self, recording: int) -> Any:
        """Ends a recording. Returns its state; if the recording has not ended yet, call again."""
        return self._ask("stop_recording", {"recording": recording})

    def replay(self, path: str, trust: list[str] | None = None, present: bool | None = None) -> Any:
        """Starts to replay a recording in a separate process, without affecting the system, and compares
        every value. Returns the number of the replay. Code modules in the recording run only if their SHA-256
        digests match modules that the system has loaded at some time, or are in `trust`."""
        return self._ask("replay", {"path": path, "trust": trust, "present": present})

    def replaying(self, replay: int) -> Any:
        """Returns the state of a replay."""
        return self._ask("replaying", {"replay": replay})

    def stop_replay(self, replay: int) -> Any:
        """Stops a replay at its current position and deletes it. Returns its final state."""
        return self._ask("stop_replay", {"replay": replay})

    def recordings(self, folder: str | None = None) -> list[Any]:
        """Returns the recordings in a folder, newest first."""
        return self._ask("recordings", {"folder": folder})

    def recorded(self, path: str) -> Any:
        """Returns a description of a recording: its time span, its contents and its ends. If the recording is
        still in progress, the description covers the part that is on disk."""
        return self._ask("recorded", {"path": path})

    def recorded_at(self, path: str, time_ns: int, names: list[str] | None = None, topics: list[str] | None = None, known: dict[str, Any] | None = None) -> Any:
        """Returns the state of a recording at a given time."""
        return self._ask("recorded_at", {"path": path, "time_ns": time_ns, "names": names, "topics": topics, "known": known})

    def recorded_messages(self, path: str, topic: str, since: int | None = None) -> Any:
        """Returns messages of a channel that carries no values, such as `/log` or `/ends`."""
        return self._ask("recorded_messages", {"path": path, "topic": topic, "since": since})

    def recorded_span(self, path: str, names: list[str], from_ns: int, to_ns: int, columns: int, since: int | None = None) -> Any:
        """Returns SVVs and cells over a span of a recording, condensed into columns, with exact sums."""
        return self._ask("recorded_span", {"path": path, "names": names, "from_ns": from_ns, "to_ns": to_ns, "columns": columns, "since": since})

    def recorded_firing(self, path: str, time_ns: int, back: bool | None = None) -> int | None:
        """Returns the time, in a recording, of the next (or previous) firing that stored a value; null if
        there is none."""
        return self._ask("recorded_firing", {"path": path, "time_ns": time_ns, "back": back})
