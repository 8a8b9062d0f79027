# SPDX-License-Identifier: Apache-2.0
"""Open systems of this process, by name. Systems left open are closed when the interpreter exits."""

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
    """Adds a system to the open systems; `key` is its name, or, for a remote system, its URL and session."""
    _open[key] = system


def forget(system: System) -> None:
    """Removes a closed system, unless another system with the same name has been created since."""
    if _open.get(system.name) is system:
        del _open[system.name]


def systems() -> list[System]:
    """Returns every open system."""
    return list(_open.values())


def running(name: Any, asked: Mapping[str, Any]) -> System | None:
    """Returns the running system of that name, if it was requested with equal arguments. Raises `InUse` if the arguments differ."""
    last = _open.get(name) if isinstance(name, str) else None
    if last is None or not (instances := last._running()):
        return None
    if said := differences(last._given, asked):
        _refuse(last.name, instances, f": {said}")
    return last


def close_last(name: str) -> None:
    """Closes the system of that name, so that it can be created again. Raises `InUse` while a verb is running in it."""
    if (last := _open.get(name)) is None:
        return
    if instances := last._running():
        _refuse(name, instances)
    last.close()


def _refuse(name: str, instances: list[str], why: str = "") -> NoReturn:
    refuse(
        InUse,
        f"system '{name}' already exists and runs {', '.join(instances)}{why}",
        "halt them, or close the system first: system.close()",
    )


@atexit.register
def _close_all() -> None:
    for system in systems():
        system._abandon()
        system.close()
