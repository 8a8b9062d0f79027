# SPDX-License-Identifier: Apache-2.0
"""Objects that already exist in a system, regardless of the program that created them: instances, devices and sources, by name."""

from __future__ import annotations

from inspect import Signature
from typing import TYPE_CHECKING, Any, TypeVar

from ..application.instances import VerbInstance
from ..definition.verbs import Verb
from ..devices.logical import LogicalDevice, ParameterMember, SvvMember, _Definition
from ..devices.physical import PhysicalDevice
from ..errors import CallError, UnknownName, did_you_mean, refusals, refuse
from ..refusals.source_location import here
from .processors import Processor
from .sources import Source

if TYPE_CHECKING:
    from .system import System

R = TypeVar("R")
D = TypeVar("D", bound=LogicalDevice)


def _configuration(system: System) -> dict[str, Any]:
    with refusals:
        return system._alive().configuration()


def fill(system: System) -> None:
    """Adds the existing processors, sources and physical devices to the object of a system to which the program has just connected."""
    there = _configuration(system)
    for name in there["processors"]:
        system.processors[name] = Processor(system, name)
    for name, about in there["sources"].items():
        kind, period_ns = (about["kind"], 0) if isinstance(about["kind"], str) else ("timer", about["kind"]["timer"]["period_ns"])
        short = name.removeprefix(about["processor"] + ".")
        system.sources[name] = Source(system, system.processors[about["processor"]], short, kind, period_ns, about["priority"])
    for name, about in there["physical_devices"].items():
        system.physical_devices[name] = PhysicalDevice(system, name, system.sources[about["source"]], about)


def instance(system: System, name: str, verb: Verb[..., R] | None) -> VerbInstance[R]:
    """Returns the instance as described in `System.instance`."""
    known = {i["name"]: i for i in system.statistics["instances"]}
    found = known.get(name)
    if found is None:
        refuse(UnknownName, f"system '{system.name}' has no verb instance '{name}'", did_you_mean(str(name), known))
    if verb is not None and verb.name != found["verb"]:
        refuse(CallError, f"verb instance '{name}' belongs to verb '{found['verb']}', not '{verb.name}'", "pass its own verb, or none")
    return VerbInstance(verb or _verb(found["verb"]), system, found["id"], {}, once=False)


def _verb(name: str) -> Any:
    """Returns a stand-in for a verb of which only the name is known. Its reports are of class `Report`, and it raises `Terminated`."""

    class Unwritten(Verb[..., Any]):
        def __init__(self) -> None:
            self.name, self.doc, self.place = name, "", here()
            self.objects, self.input_parameters, self.conditions = {}, {}, {}
            self._function = None
            self.signature = self.arguments_signature = self.inputs_signature = Signature()

        def __repr__(self) -> str:
            return f"verb {name}, of which only the name is known"

    return Unwritten()


def device(system: System, name: str, kind: type[D]) -> D:
    """Returns the device as described in `System.device`."""
    there = _configuration(system)
    of = there["logical_devices"].get(name)
    if of is None:
        refuse(UnknownName, f"system '{system.name}' has no logical device '{name}'", did_you_mean(str(name), there["logical_devices"]))
    if kind is LogicalDevice:
        made: Any = _kind(there["device_types"][of])
    elif kind.definition_name() != of:
        refuse(CallError, f"device '{name}' is a {of}, not a {kind.definition_name()}", "pass the class of its type, or none")
    else:
        made = kind
    found = made.__new__(made)
    found.name, found.system, found._whole = name, system, True
    found._enter()
    return found


class _AsItIs:
    """Marks a class that must not be checked as a new definition, because its type already exists in the system."""

    def __init_subclass__(cls, **_: Any) -> None:
        return


def _kind(of: dict[str, Any]) -> type[LogicalDevice]:
    """Returns a class, with members but without a verb, for a device type known only from the system."""
    members: dict[str, Any] = {"__doc__": of.get("doc") or None, "_definition": _Definition(of["name"], None, of["arbitration"], here())}
    for name, member in of["svvs"].items():
        members[name] = SvvMember(member["type_text"], member.get("unit", ""), None, member.get("history", 0), shared=member.get("shared"))
    for name, member in of["parameters"].items():
        members[name] = ParameterMember(member["default"], member.get("unit", ""), member.get("tunable", False))
    return type(of["name"], (_AsItIs, LogicalDevice), members)
