# SPDX-License-Identifier: Apache-2.0
"""Registered drivers: their declarations, and the devices that they find."""

from __future__ import annotations

import builtins
import json
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from .. import _native
from ..driver.base import Driver
from ..driver.manual import about as declaration
from ..driver.manual import scanned
from ..driver.process import loaded
from ..errors import CallError, DeviceFailed, Error, UnknownName, did_you_mean, refusals, refuse
from ..values.quantities import duration_text
from ..values.tables import Table, TableDisplay, Tables
from .in_python import where
from .loading import load

Look = Callable[[str, Mapping[str, Any]], builtins.list[dict[str, Any]]]
"""Function that searches for devices with one driver. It takes the driver's kind and options, and returns for each device a description
and the options that open it."""


class Manual(TableDisplay):
    """Declaration of a driver: `kind`, `doc`, `class_`, `options`, `safe_state`, `services`, `counters`, `rights`, `scans`."""

    def __init__(self, about: Mapping[str, Any], source: str | None = None) -> None:
        self.about = about
        self.source: str = source or about["kind"]
        """Argument that selects the driver in `show` and `scan`: its kind, or the file that defines it."""
        self.kind: str = about["kind"]
        self.doc: str = about["doc"]
        self.class_: str = about["class"]
        """Execution context of the driver's exchanges: `inline`, `worker` or `process`."""
        self.options: builtins.list[dict[str, Any]] = about["options"]
        self.safe_state: dict[str, Any] = about["safe_state"]
        self.services: builtins.list[dict[str, Any]] = about["services"]
        self.counters: builtins.list[dict[str, Any]] = about["counters"]
        self.rights: builtins.list[str] = about["rights"]
        self.scans: bool = about["scans"]
        """True if the driver can search for devices."""

    def _lines(self) -> Iterator[str]:
        yield f"{self.kind}: {self.doc}"
        yield f"exchanges: {_CLASSES.get(self.class_, self.class_)}"
        yield f"safe state: {safe_state_text(self.safe_state)}"
        waits, lost = self.about["waits_ns"], self.about["lost_within_ns"]
        yield f"opening waits for the device: {duration_text(waits)}" if waits else "opening fails if the device is absent"
        yield f"loss detected within {duration_text(lost)}" if lost else "loss detected by the next exchange"
        yield f"rights: {'; '.join(self.rights) or 'those of the user'}"
        yield f"can search for devices: {f'opengpac devices scan {self.source}' if self.scans else 'no'}"

    def __str__(self) -> str:
        return repr(self._table())

    def _table(self) -> Tables:
        columns = ["option", "kind", "unit", "range", "default", "description"]
        tables = [Table("options", columns, [_option(of) for of in self.options])]
        services = [(s["name"], ", ".join(a["name"] for a in s["arguments"]), s["answer"] or "", _what_it_does(s)) for s in self.services]
        tables.append(Table("services", ["service", "arguments", "answer", "description"], services))
        tables.append(Table("counters", ["counter", "unit", "description"], [(c["name"], c["unit"], c["doc"]) for c in self.counters]))
        return Tables([table for table in tables if table.rows], "\n".join(self._lines()))

    def __repr__(self) -> str:
        return f"driver {self.kind}: {self.doc}"


def _option(of: Mapping[str, Any]) -> tuple[str, ...]:
    left_out = "required" if of["default"] is None else of["default"]
    return of["name"], of["kind"], of["unit"], of.get("range", ""), left_out, of["doc"]


_CLASSES = {
    "inline": "on the thread of its source",
    "worker": "on a separate thread",
    "process": "in a separate process",
}


def safe_state_text(about: Mapping[str, Any]) -> str:
    """Returns the safe state as text: `torque off, by driver and device, within 20 ms`."""
    within = f", within {duration_text(about['within_ns'])}" if about["within_ns"] else ""
    return f"{about['doc']}, by {' and '.join(about['by'])}{within}"


class Manuals(builtins.list[Manual], TableDisplay):
    """List of the manuals of drivers."""

    def __str__(self) -> str:
        return repr(self._table())

    def _table(self) -> Table:
        rows = [(m.kind, m.class_, "yes" if m.scans else "", m.doc) for m in self]
        return Table("drivers", ["driver", "class", "scans", "description"], rows)


class Found(builtins.list[dict[str, Any]], TableDisplay):
    """Devices found, each as `{"driver", "what", "options"}`; `problems` lists the drivers that could not search, with their reasons."""

    def __init__(self, found: builtins.list[dict[str, Any]], problems: Mapping[str, str]) -> None:
        super().__init__(found)
        self.problems = dict(problems)

    def __str__(self) -> str:
        return repr(self._table())

    def _table(self) -> Tables:
        rows = [(found["driver"], found["what"], json.dumps(found["options"], separators=(", ", ": "))) for found in self]
        tables = [Table("", ["driver", "device", "options"], rows)] if rows else []
        head = [f"{len(self)} device{'' if len(self) == 1 else 's'} found", *(f"{kind}: {why}" for kind, why in self.problems.items())]
        return Tables(tables, "\n".join(head))


def list() -> Manuals:
    """Returns the drivers of this installation with their declarations."""
    return Manuals(Manual(about) for about in json.loads(_native.drivers_json()))


def show(kind: str) -> Manual:
    """Returns the declaration of a driver: options with units and defaults, class, safe state, services, counters, privileges.

    `kind` may also be the file of a driver in Python, `"thermometer.py"` or `"package.module:Class"`, or a file that
    `gpac.drivers.load` accepts, `"conveyor.c"`. `manuals` returns all manuals of a file with several drivers.
    """
    found = manuals(kind)
    if len(found) != 1:
        refuse(CallError, f"'{kind}' has {len(found)} drivers: {', '.join(m.kind for m in found)}", "call manuals() for all of them")
    return found[0]


def manuals(kind: str) -> Manuals:
    """Returns the manual of a driver, or of each driver in a file or folder. `kind` is as in `show`."""
    known = {manual.kind: manual for manual in list()}
    if kind in known:
        return Manuals([known[kind]])
    if not is_file(kind):
        refuse(UnknownName, f"there is no driver '{kind}'", did_you_mean(kind, known))
    if _is_class(kind):
        return Manuals([_of_class(kind, known["python"].about)])
    return Manuals(Manual(about, kind) for _, about in load(kind).manuals)


def is_file(kind: str) -> bool:
    """Returns whether `kind` is a driver's file rather than a registered kind; `name@/its/file.so`, a loaded driver, is a kind."""
    name, _, kept = kind.partition("@")
    if os.sep not in name and Path(kept).is_absolute():
        return False
    return _is_class(kind) or bool(Path(kind).suffix) or (Path(kind).is_dir() and all(kind != manual.kind for manual in list()))


def _is_class(source: str) -> bool:
    return source.endswith(".py") or (":" in source and os.sep not in source)


def _class_of(source: str) -> type[Driver]:
    given = where(source, None)
    try:
        return loaded(given.get("path"), given.get("module"), given.get("class"))
    except Error:
        raise
    except Exception as why:
        refuse(DeviceFailed, f"'{source}' cannot be loaded: {type(why).__name__}: {why}", "fix it first")


def _of_class(source: str, general: Mapping[str, Any]) -> Manual:
    """Returns the manual of a driver in Python: the declarations of its class, and the declarations common to all such drivers."""
    made = _class_of(source)
    beside = [option for option in general["options"] if option["name"] in ("period_ns", "age_max_ns", "timeout_ns")]
    about = declaration(made)
    return Manual({**general, **about, "kind": made.__name__, "options": [*about["options"], *beside]}, source)


def scan(kind: str | None = None, **options: Any) -> Found:
    """Searches for devices that a driver could open, without moving any machine. `options` limit the search; they are the same as for
    opening a device.

    Without `kind`, every driver that supports it searches; `problems` of the result contains the failures. `kind` may be a file, as
    for `show`. Searches this host; `cell.scan_devices(kind)` searches the host of a remote system.
    """
    return searched(_here, kind, options) if kind is None or not is_file(kind) else _in_file(kind, options)


def _in_file(source: str, options: Mapping[str, Any]) -> Found:
    if _is_class(source):
        made = _class_of(source)
        return Found([{"driver": made.__name__, **device} for device in scanned(made, options)], {})
    declared = [*load(source).manuals]
    looking = [(kind, about) for kind, about in declared if about["scans"]] or declared[:1]
    return Found([{"driver": about["kind"], **device} for kind, about in looking for device in _here(kind, options)], {})


def _here(kind: str, options: Mapping[str, Any]) -> builtins.list[dict[str, Any]]:
    with refusals:
        return json.loads(_native.scan(kind, json.dumps(options)))


def on_host_of(system: Any) -> Look:
    """Returns a function that lets drivers search for devices on the host of `system`, which may be local or remote."""

    def look(kind: str, options: Mapping[str, Any]) -> builtins.list[dict[str, Any]]:
        with refusals:
            return system.scan_devices(kind, dict(options))

    return look


def searched(look: Look, kind: str | None, options: Mapping[str, Any]) -> Found:
    """Returns the devices that drivers find through `look`; without a kind, all drivers that can search do so."""
    kinds = [manual.kind for manual in list() if manual.scans] if kind is None else [kind]
    found: builtins.list[dict[str, Any]] = []
    problems: dict[str, str] = {}
    for each in kinds:
        try:
            answer = look(each, options)
        except Error as error:
            if kind is not None:
                raise
            problems[each] = error.message
            continue
        found += [{"driver": each, **device} for device in answer]
    return Found(found, problems)


def _what_it_does(service: Mapping[str, Any]) -> str:
    return f"{service['doc']}; moves the machine" if service["moves"] else service["doc"]
