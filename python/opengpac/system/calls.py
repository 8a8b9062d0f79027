# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501
"""The calls on a real-time system, made from their declarations in crates/api: do not edit.

What moves bytes at a rate has methods of its own, see `realtime.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .call_transport import CallTransport

LASTING = frozenset({"device_service", "scan_devices", "device_served", "wait_enabled", "disable", "perform", "performed", "wait", "halt", "advance", "pause", "paused"})
"""Calls that last, and go on in slices."""


class Calls(CallTransport):
    """Every call as a method. An argument that is None is left out."""

    __slots__ = ()

    def processor(self, name: str, core: int | None = None, supervisor: bool | None = None, process: Any = None, host: str | None = None, lost_after_ns: int | None = None, patience_ns: int | None = None) -> None:
        """Makes a real-time processor."""
        return self._ask("processor", {"name": name, "core": core, "supervisor": supervisor, "process": process, "host": host, "lost_after_ns": lost_after_ns, "patience_ns": patience_ns})

    def listen(self, endpoint: str, name: str, authority: str | None = None, certificate: str | None = None, key: str | None = None, token: str | None = None, clock_limit_ns: int | None = None) -> None:
        """Lets other hosts join."""
        return self._ask("listen", {"endpoint": endpoint, "name": name, "authority": authority, "certificate": certificate, "key": key, "token": token, "clock_limit_ns": clock_limit_ns})

    def take_over(self) -> Any:
        """Lets go on what runs in processes that lost a system of this name; the system is opened with
        "adopt": true."""
        return self._ask("take_over")

    def source(self, processor: str, name: str, kind: str, priority: int, period_ns: int | None = None, virtual_cost_ns: int | None = None) -> None:
        """Makes an interrupt source of a processor."""
        return self._ask("source", {"processor": processor, "name": name, "kind": kind, "priority": priority, "period_ns": period_ns, "virtual_cost_ns": virtual_cost_ns})

    def request(self, source: str) -> None:
        """Requests a software source: it fires once."""
        return self._ask("request", {"source": source})

    def physical_device(self, processor: str, name: str, kind: str, source: str, options: dict[str, Any] | None = None, place: Any = None) -> Any:
        """Opens a device for a source. Returns its channels and parts."""
        return self._ask("physical_device", {"processor": processor, "name": name, "kind": kind, "source": source, "options": options, "place": place})

    def device_service(self, device: str, service: str, arguments: dict[str, Any] | None = None) -> Any:
        """Lets the driver of a device carry out a service, off the cycle. Returns what that answers."""
        return self._ask("device_service", {"device": device, "service": service, "arguments": arguments})

    def scan_devices(self, kind: str, options: dict[str, Any] | None = None) -> Any:
        """Looks on the host of the system for devices that a driver could open; nothing moves. Returns what
        each is, and the options that open it."""
        return self._ask("scan_devices", {"kind": kind, "options": options})

    def device_served(self, errand: int) -> Any:
        """Waits for a service or a search that goes on. Returns what it answers, once."""
        return self._ask("device_served", {"errand": errand})

    def reopen_physical_device(self, name: str) -> None:
        """Opens a device that was lost again, with everything that is bound to it."""
        return self._ask("reopen_physical_device", {"name": name})

    def delete_physical_device(self, name: str) -> None:
        """Closes a device."""
        return self._ask("delete_physical_device", {"name": name})

    def raises(self, device: str, channel: str, source: str, place: Any = None) -> None:
        """Lets a channel of a device request a source."""
        return self._ask("raises", {"device": device, "channel": channel, "source": source, "place": place})

    def place(self, placement: Mapping[str, Any]) -> None:
        """Says on which sources blocks run that nothing else places: source by pattern of labels."""
        return self._ask_of("place", placement)

    def download(self, path: str, name: str | None = None, python: str | None = None) -> Any:
        """Loads a code module. Returns its blocks."""
        return self._ask("download", {"path": path, "name": name, "python": python})

    def define_verb(self, verb: Mapping[str, Any]) -> None:
        """Enters a verb."""
        return self._ask_of("define_verb", verb)

    def check_graph(self, graph: Mapping[str, Any]) -> None:
        """Refuses a data flow graph that is wrong; nothing is entered."""
        return self._ask_of("check_graph", graph)

    def check_definition(self, drawing: Mapping[str, Any]) -> list[Any]:
        """Returns all that is wrong with a graph or a verb, each with "where"; nothing is entered."""
        return self._ask_of("check_definition", drawing)

    def check_drawing(self, drawing: Mapping[str, Any]) -> list[Any]:
        """Returns all that is wrong with a graph or a verb, as `check_definition` does, and what installing
        it would refuse whatever it is given: constants, defaults, members of objects, second writers in a
        list. Nothing is entered."""
        return self._ask_of("check_drawing", drawing)

    def compatible(self, drawing: Mapping[str, Any], from_: Any, to: Any = None) -> Any:
        """Returns why two ports of a graph or a verb cannot be wired, or null; without `to`, why each other
        one cannot."""
        return self._ask_of("compatible", drawing, {"from": from_, "to": to})

    def define_device_type(self, device_type: Mapping[str, Any]) -> None:
        """Enters a type of logical devices."""
        return self._ask_of("define_device_type", device_type)

    def compose(self, composition: Mapping[str, Any]) -> Any:
        """Returns the verb that a composition of verbs is; nothing is entered."""
        return self._ask_of("compose", composition)

    def svv(self, specification: Mapping[str, Any], name: str, place: Any = None) -> None:
        """Makes an SVV."""
        return self._ask_of("svv", specification, {"name": name, "place": place})

    def delete_svv(self, name: str) -> None:
        """Deletes an SVV that nothing is bound to."""
        return self._ask("delete_svv", {"name": name})

    def library(self) -> list[Any]:
        """Returns every block: of the library, of code modules."""
        return self._ask("library")

    def fuse(self, on: bool | None = None) -> Any:
        """Fuses blocks in C that are always due together, for a second; with groups `waiting` it is to be
        called again. Returns what is fused."""
        return self._ask("fuse", {"on": on})

    def fused(self) -> Any:
        """Returns what is fused, and what is not and why."""
        return self._ask("fused")

    def device(self, request: Mapping[str, Any], name: str) -> None:
        """Makes a logical device, with its own verb instance."""
        return self._ask_of("device", request, {"name": name})

    def enable(self, name: str) -> int:
        """Starts the verb that keeps a device going. Returns that instance, 0 where there is none. It is
        enabled when it is ready."""
        return self._ask("enable", {"name": name})

    def wait_enabled(self, name: str, timeout_ns: int | None = None, until_ns: int | None = None) -> bool:
        """Waits until a device is enabled. Returns whether it is."""
        return self._ask("wait_enabled", {"name": name, "timeout_ns": timeout_ns, "until_ns": until_ns})

    def disable(self, name: str) -> None:
        """Ends the verbs that use a device, then its own; waits until that is done."""
        return self._ask("disable", {"name": name})

    def exchange_verb(self, device: str, verb: str, place: Any = None) -> None:
        """Replaces the verb that keeps a device going by another one, within one firing where it is
        enabled."""
        return self._ask("exchange_verb", {"device": device, "verb": verb, "place": place})

    def delete_device(self, name: str) -> None:
        """Deletes a device."""
        return self._ask("delete_device", {"name": name})

    def device_state(self, name: str) -> Any:
        """Returns "disabled", "enabling", "standstill", "moving", "stopping" or "fault"."""
        return self._ask("device_state", {"name": name})

    def device_parameter(self, name: str, parameter: str) -> Any:
        """Returns the value of a parameter."""
        return self._ask("device_parameter", {"name": name, "parameter": parameter})

    def set_device_parameter(self, name: str, parameter: str, value: Any) -> None:
        """Sets a parameter."""
        return self._ask("set_device_parameter", {"name": name, "parameter": parameter, "value": value})

    def describe_arm(self, arm: Mapping[str, Any]) -> None:
        """Enters an arm, in the place of the one of that name: its joints, and the geometry that joins them
        or the reason why it is not known."""
        return self._ask_of("describe_arm", arm)

    def arms(self) -> list[Any]:
        """Returns the arms whose joints are there."""
        return self._ask("arms")

    def name_points(self, arm: str, path: str, model: str, joints: list[str], units: list[str], any_model: bool | None = None) -> None:
        """Says in which file the taught points of an arm are kept; the first point makes it."""
        return self._ask("name_points", {"arm": arm, "path": path, "model": model, "joints": joints, "units": units, "any_model": any_model})

    def points(self, arm: str) -> Any:
        """Returns the taught points of an arm as its file has them now, with its frames and tools."""
        return self._ask("points", {"arm": arm})

    def teach_point(self, arm: str, point: Any) -> None:
        """Enters a taught point into the file of an arm, in the place of the one of that name."""
        return self._ask("teach_point", {"arm": arm, "point": point})

    def rename_point(self, arm: str, name: str, to: str) -> None:
        """Gives a taught point another name; it keeps its place."""
        return self._ask("rename_point", {"arm": arm, "name": name, "to": to})

    def delete_point(self, arm: str, name: str) -> Any:
        """Removes a taught point, and returns it."""
        return self._ask("delete_point", {"arm": arm, "name": name})

    def check(self, application: Mapping[str, Any]) -> Any:
        """Plans an application without making anything. Returns the plan."""
        return self._ask_of("check", application)

    def perform(self, application: Mapping[str, Any], limits: Any = None) -> Any:
        """Calls a verb: makes an instance, starts it with the values of the application, waits until it has
        ended and deletes it. Returns its end report."""
        return self._ask_of("perform", application, {"limits": limits})

    def performed(self, instance: int) -> Any:
        """Goes on with the call of a verb: waits until its instance has ended and deletes it. Returns its end
        report."""
        return self._ask("performed", {"instance": instance})

    def create(self, application: Mapping[str, Any]) -> int:
        """Makes an instance. Returns its number."""
        return self._ask_of("create", application)

    def start(self, instance: int, values: dict[str, Any] | None = None, limits: Any = None) -> None:
        """Starts an instance."""
        return self._ask("start", {"instance": instance, "values": values, "limits": limits})

    def wait(self, instance: int, timeout_ns: int | None = None, until_ns: int | None = None) -> Any:
        """Waits until an instance has ended. Returns its end report, null after the timeout."""
        return self._ask("wait", {"instance": instance, "timeout_ns": timeout_ns, "until_ns": until_ns})

    def halt(self, instance: int, timeout_ns: int | None = None, until_ns: int | None = None) -> Any:
        """Ends an instance and waits until it has ended: a transition on `halted` may lie between, a second
        halt is immediate. Returns its end report."""
        return self._ask("halt", {"instance": instance, "timeout_ns": timeout_ns, "until_ns": until_ns})

    def suspend(self, instance: int) -> None:
        """Lets what an instance is doing run dry, then holds it."""
        return self._ask("suspend", {"instance": instance})

    def resume(self, instance: int) -> None:
        """Lets a suspended instance go on."""
        return self._ask("resume", {"instance": instance})

    def delete(self, instance: int) -> None:
        """Deletes an instance that has ended."""
        return self._ask("delete", {"instance": instance})

    def state(self, instance: int) -> Any:
        """Returns "created", "queued", "running", "suspended", "ended" or "deleted"."""
        return self._ask("state", {"instance": instance})

    def instance(self, instance: int) -> Any:
        """Returns what an instance is: its name, verb, state, blocks, conditions and lists."""
        return self._ask("instance", {"instance": instance})

    def report(self, instance: int) -> Any:
        """Returns the end report of the latest start, null while it lasts."""
        return self._ask("report", {"instance": instance})

    def set(self, instance: int, values: dict[str, Any] | None = None, every_ns: dict[str, Any] | None = None) -> None:
        """Sets tunable input parameters and intervals of a running instance."""
        return self._ask("set", {"instance": instance, "values": values, "every_ns": every_ns})

    def write(self, name: str, value: Any) -> None:
        """Stores a value."""
        return self._ask("write", {"name": name, "value": value})

    def svv_about(self, name: str) -> Any:
        """Returns what is known of an SVV, a private cell or a channel: its type, unit, history, writers."""
        return self._ask("svv_about", {"name": name})

    def now(self) -> int:
        """Returns the time of the system, ns."""
        return self._ask("now")

    def advance(self, duration_ns: int) -> None:
        """Under the virtual clock: runs the firings in (now, now + duration]."""
        return self._ask("advance", {"duration_ns": duration_ns})

    def step(self) -> bool:
        """Under the virtual clock: runs the next firing, whenever that is. Returns false where nothing is
        ever going to happen."""
        return self._ask("step")

    def emergency_stop(self, reason: str) -> None:
        """Stops everything that moves, until `reset`."""
        return self._ask("emergency_stop", {"reason": reason})

    def emergency_stop_input(self, device: str, channel: str, at_zero: bool | None = None) -> None:
        """Lets a channel of a device stop everything that moves."""
        return self._ask("emergency_stop_input", {"device": device, "channel": channel, "at_zero": at_zero})

    def reset(self) -> dict[str, Any]:
        """Ends the emergency stop, and opens devices again that were lost. Returns those that are lost still,
        each with why."""
        return self._ask("reset")

    def pause(self, devices: list[str] | None = None) -> list[str]:
        """Suspends what is done with these logical devices, or with all, and waits until it is. Returns the
        names of these instances."""
        return self._ask("pause", {"devices": devices})

    def paused(self, instances: list[int], names: list[str]) -> list[str]:
        """Waits until these instances have stopped. Returns their names."""
        return self._ask("paused", {"instances": instances, "names": names})

    def resume_program(self, devices: list[str] | None = None) -> list[str]:
        """Takes a pause back. Returns the names of the instances that go on or begin."""
        return self._ask("resume_program", {"devices": devices})

    def mode(self) -> Any:
        """Returns "automatic" or "manual"."""
        return self._ask("mode")

    def set_mode(self, mode: Any) -> None:
        """Changes the mode."""
        return self._ask("set_mode", {"mode": mode})

    def enabling_switch(self, device: str, channel: str) -> None:
        """Names the channel of the enabling switch, without which nothing moves in manual mode."""
        return self._ask("enabling_switch", {"device": device, "channel": channel})

    def define_alarm(self, said: Mapping[str, Any], code: str) -> None:
        """Says what the alarms of a code mean."""
        return self._ask_of("define_alarm", said, {"code": code})

    def raise_alarm(self, code: str, source: str | None = None, text: str | None = None) -> None:
        """Raises an alarm."""
        return self._ask("raise_alarm", {"code": code, "source": source, "text": text})

    def clear_alarm(self, code: str, source: str | None = None) -> bool:
        """Says that the cause of an alarm is gone. Returns whether there was one."""
        return self._ask("clear_alarm", {"code": code, "source": source})

    def alarms(self) -> Any:
        """Returns all alarms, those that are shelved, and their history."""
        return self._ask("alarms")

    def acknowledge_alarms(self, number: int | None = None) -> int:
        """Acknowledges one alarm, or all that are not shelved. Returns how many."""
        return self._ask("acknowledge_alarms", {"number": number})

    def shelve_alarm(self, number: int, reason: str, for_ns: int, who: str | None = None) -> None:
        """Takes an alarm out of the list for a time. Emergency stops, what is lost, and the severity critical
        stay in it."""
        return self._ask("shelve_alarm", {"number": number, "reason": reason, "for_ns": for_ns, "who": who})

    def unshelve_alarm(self, number: int, who: str | None = None) -> bool:
        """Puts a shelved alarm back into the list. Returns whether it was shelved."""
        return self._ask("unshelve_alarm", {"number": number, "who": who})

    def restore_alarms(self, history: list[Any]) -> None:
        """Enters the history of an earlier life."""
        return self._ask("restore_alarms", {"history": history})

    def names(self) -> Any:
        """Returns the names of what there is."""
        return self._ask("names")

    def configuration(self) -> Any:
        """Returns processors, sources, devices as their drivers describe them, device types."""
        return self._ask("configuration")

    def installed(self) -> Any:
        """Returns every instance with its blocks, ports, cells, command lists, conditions and transitions."""
        return self._ask("installed")

    def verbs(self) -> list[Any]:
        """Returns the verbs that are entered."""
        return self._ask("verbs")

    def verb_form(self, name: str) -> Any:
        """Returns what a form that starts a verb needs: its arguments and input parameters."""
        return self._ask("verb_form", {"name": name})

    def geometry(self, device: str) -> Any:
        """Returns the bodies, joints, shapes and meshes of a physical device, for drawing."""
        return self._ask("geometry", {"device": device})

    def statistics(self) -> Any:
        """Returns how sources, instances and devices run."""
        return self._ask("statistics")

    def probe(self, for_ns: int, source: str | None = None) -> None:
        """Visits the blocks of a source, or of all, one a firing: then `statistics` tells how long they
        take."""
        return self._ask("probe", {"for_ns": for_ns, "source": source})

    def log(self, since: int | None = None) -> list[Any]:
        """Returns commands, conditions, faults, transitions and ends."""
        return self._ask("log", {"since": since})

    def ship_workspace(self, workspace: Mapping[str, Any]) -> None:
        """Enters a workspace that a program ships, in the place of the one that it shipped before under that
        name."""
        return self._ask_of("ship_workspace", workspace)

    def withdraw_workspace(self, name: str) -> None:
        """Removes a workspace that a program has shipped."""
        return self._ask("withdraw_workspace", {"name": name})

    def keep_workspace(self, workspace: Mapping[str, Any]) -> None:
        """Keeps a workspace for all who look at the system. One that a program has shipped is not
        replaced."""
        return self._ask_of("keep_workspace", workspace)

    def forget_workspace(self, name: str) -> None:
        """Removes a workspace that a person keeps."""
        return self._ask("forget_workspace", {"name": name})

    def workspaces(self) -> list[Any]:
        """Returns the workspaces, each in one line."""
        return self._ask("workspaces")

    def workspace(self, name: str) -> Any:
        """Returns a workspace."""
        return self._ask("workspace", {"name": name})

    def check_workspace(self, workspace: Mapping[str, Any]) -> list[Any]:
        """Returns all that is wrong with a workspace here and now: its form, and what it names and is not
        there."""
        return self._ask_of("check_workspace", workspace)

    def record(self, path: str, svvs: list[str] | None = None, cells: bool | None = None, replay: bool | None = None, split_bytes: int | None = None, keep: int | None = None, identity: str | None = None, resumes: bool | None = None) -> Any:
        """Begins to record into a new MCAP file. Returns its number."""
        return self._ask("record", {"path": path, "svvs": svvs, "cells": cells, "replay": replay, "split_bytes": split_bytes, "keep": keep, "identity": identity, "resumes": resumes})

    def recording(self, recording: int) -> Any:
        """Returns how a recording stands."""
        return self._ask("recording", {"recording": recording})

    def stop_recording(self, recording: int) -> Any:
        """Ends a recording. Returns how it stands; where it still runs, it is to be called again."""
        return self._ask("stop_recording", {"recording": recording})

    def replay(self, path: str, trust: list[str] | None = None, present: bool | None = None) -> Any:
        """Begins to run a recording again, in a process of its own beside the system, which it does not
        touch, and compares every value. Returns its number. Code modules that the recording brings run only
        where their SHA-256 digests are those of modules that the system has had, or are in `trust`."""
        return self._ask("replay", {"path": path, "trust": trust, "present": present})

    def replaying(self, replay: int) -> Any:
        """Returns how a replay stands."""
        return self._ask("replaying", {"replay": replay})

    def stop_replay(self, replay: int) -> Any:
        """Ends a replay where it is, and forgets it. Returns how it stood."""
        return self._ask("stop_replay", {"replay": replay})

    def recordings(self, folder: str | None = None) -> list[Any]:
        """Returns the recordings of a folder, the newest first."""
        return self._ask("recordings", {"folder": folder})

    def recorded(self, path: str) -> Any:
        """Returns what a recording is: when, of what, how it ended. One that is under way is told as far as
        it is on the disk."""
        return self._ask("recorded", {"path": path})

    def recorded_at(self, path: str, time_ns: int, names: list[str] | None = None, topics: list[str] | None = None, known: dict[str, Any] | None = None) -> Any:
        """Returns what was at a time of a recording."""
        return self._ask("recorded_at", {"path": path, "time_ns": time_ns, "names": names, "topics": topics, "known": known})

    def recorded_messages(self, path: str, topic: str, since: int | None = None) -> Any:
        """Returns messages of a channel that has no values, `/log`, `/ends`, …"""
        return self._ask("recorded_messages", {"path": path, "topic": topic, "since": since})

    def recorded_span(self, path: str, names: list[str], from_ns: int, to_ns: int, columns: int, since: int | None = None) -> Any:
        """Returns SVVs and cells over a span of a recording, drawn together into columns, with exact sums."""
        return self._ask("recorded_span", {"path": path, "names": names, "from_ns": from_ns, "to_ns": to_ns, "columns": columns, "since": since})

    def recorded_firing(self, path: str, time_ns: int, back: bool | None = None) -> int | None:
        """Returns the time of the next firing of a recording that stored a value, or of the one before; null
        where there is none."""
        return self._ask("recorded_firing", {"path": path, "time_ns": time_ns, "back": back})
