# SPDX-License-Identifier: Apache-2.0
"""Catalogue of driver classes: loads the class in a file, and returns its declaration, its services, and the devices that it finds."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import CallError, DeviceFailed, did_you_mean, refuse
from .base import Driver
from .members import Counter, OptionMember, Part, Service, annotated


def services_of(kind: type[Driver]) -> dict[str, Service]:
    """Returns the services that programs can call, by name."""
    found = {n: getattr(m, "service", None) for base in reversed(kind.__mro__) for n, m in vars(base).items()}
    return {name: made for name, made in found.items() if isinstance(made, Service)}


def scanned(kind: type[Driver], options: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Returns the devices that a class finds. Refuses classes that cannot scan, unknown options, and malformed results."""
    name = kind.__name__
    if not _scans(kind):
        refuse(CallError, f"driver '{name}' cannot search for devices", "see its manual for the options that open one, or define scan(cls)")
    declared = kind.members(OptionMember)
    for wrong in options.keys() - declared.keys():
        refuse(CallError, f"driver {name} has no option '{wrong}'", did_you_mean(wrong, declared))
    given = {n: declared[n].taken(annotated(kind, n), value, f"option '{n}' of driver {name}") for n, value in options.items()}
    try:
        found = [{"what": str(device["what"]), "options": dict(device["options"])} for device in kind.scan(**given)]
    except (KeyError, TypeError, ValueError) as why:
        remedy = 'return a list of {"what": text, "options": {name: value}}'
        refuse(DeviceFailed, f"scan() of driver {name} returns invalid results: {type(why).__name__}: {why}", remedy)
    except Exception as why:
        refuse(DeviceFailed, f"driver {name} cannot search for devices: {type(why).__name__}: {why}")
    return found


def _scans(kind: type[Driver]) -> bool:
    return kind.scan.__func__ is not Driver.scan.__func__  # type: ignore[attr-defined]


def about(kind: type[Driver]) -> dict[str, Any]:
    """Returns the declaration of a driver for manuals: `doc`, `options`, `services`, `counters`, `parts`, `scans`."""
    return {
        "doc": (inspect.getdoc(kind) or "").partition("\n")[0].rstrip("."),
        "options": [option.about(name, annotated(kind, name)) for name, option in kind.members(OptionMember).items()],
        "services": [made.about() for made in services_of(kind).values()],
        "counters": [made.about() for made in kind.members(Counter).values()],
        "parts": [made.about() for made in kind.members(Part).values()],
        "scans": _scans(kind),
    }


def the_driver(members: Mapping[str, Any], module: str, where: str, name: str | None) -> type[Driver]:
    """Returns the driver class of a module: the class called `name`, or the only one that the module itself declares."""
    found = {n: m for n, m in members.items() if isinstance(m, type) and issubclass(m, Driver) and m.__module__ == module}
    if name is None and len(found) == 1:
        return next(iter(found.values()))
    if name is None:
        many: Sequence[str] = [*found]
        refuse(
            CallError,
            f"{where} has {len(many)} drivers{': ' if many else ''}{', '.join(many)}",
            "derive one class from opengpac.driver.Driver, or pass the name of one of several",
        )
    chosen = members.get(name)
    if not (isinstance(chosen, type) and issubclass(chosen, Driver)):
        refuse(CallError, f"{where} has no driver '{name}'", did_you_mean(name, found))
    return chosen
