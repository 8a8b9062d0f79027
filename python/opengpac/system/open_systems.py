# SPDX-License-Identifier: Apache-2.0
"""The systems of this process that are open, by name; those that are left are closed when the interpreter ends."""

from __future__ import annotations

import atexit
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NoReturn
from weakref import WeakValueDictionary

from ..errors import InUse, refuse
from .repeated import differences

if TYPE_CHECKING:
    from .system import System

_open: WeakValueDictionary[str, System] = WeakValueDictionary()


def keep(system: System, key: str) -> None:
    """Counts a system among the open ones; `key` is its name, or of a remote one its URL and session."""
    _open[key] = system


def forget(system: System) -> None:
    """Takes out a system that is closed, unless another of its name was made since."""
    if _open.get(system.name) is system:
        del _open[system.name]


def systems() -> list[System]:
    """Every open system."""
    return list(_open.values())


def running(name: Any, asked: Mapping[str, Any]) -> System | None:
    """The system of that name in which something runs, where it was asked for equally. Refused with `InUse` where it was not."""
    last = _open.get(name) if isinstance(name, str) else None
    if last is None or not (instances := last._running()):
        return None
    if said := differences(last._given, asked):
        _refuse(last.name, instances, f": {said}")
    return last


def close_last(name: str) -> None:
    """Closes the system of that name, for one that is made again. Refused with `InUse` while something runs in it."""
    if (last := _open.get(name)) is None:
        return
    if instances := last._running():
        _refuse(name, instances)
    last.close()


def _refuse(name: str, instances: list[str], why: str = "") -> NoReturn:
    refuse(InUse, f"system '{name}' exists and runs {', '.join(instances)}{why}", "halt them, or close the system first: system.close()")


@atexit.register
def _close_all() -> None:
    for system in systems():
        system._abandon()
        system.close()
