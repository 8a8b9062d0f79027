# SPDX-License-Identifier: Apache-2.0
"""The systems of this process that are open, by name; those that are left are closed when the interpreter ends."""

from __future__ import annotations

import atexit
from typing import TYPE_CHECKING
from weakref import WeakValueDictionary

from .errors import InUse, refuse

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


def close_last(name: str) -> None:
    """Closes the system of that name, for one that is made again. Refused with `InUse` while something runs in it."""
    last = _open.get(name)
    if last is None:
        return
    running = last._running()
    if running:
        refuse(InUse, f"system '{name}' exists and runs {', '.join(running)}", "halt them, or close the system first: system.close()")
    last.close()


@atexit.register
def _close_all() -> None:
    for system in systems():
        system._abandon()
        system.close()
