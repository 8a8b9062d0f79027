# SPDX-License-Identifier: Apache-2.0
"""Forked processes. A fork does not inherit the threads of its parent's real-time system, so it cannot use that system."""

from __future__ import annotations

import ctypes
import os
from typing import TYPE_CHECKING, Any, NoReturn
from weakref import WeakSet

from ..errors import InvalidState, refuse

if TYPE_CHECKING:
    from .system import System

_systems: WeakSet[System] = WeakSet()

_PARENT = os.getpid()


class NotHere:
    """Stand-in for a real-time system that runs in the parent process; refuses every call with that reason."""

    def __init__(self, name: str, process: int) -> None:
        self._name, self._process = name, process

    def __getattr__(self, call: str) -> NoReturn:
        where = f"system '{self._name}' runs in process {self._process}; process {os.getpid()} was forked from it and cannot use it"
        refuse(InvalidState, where, "create a separate system here, or start processes with 'spawn' of multiprocessing")


def known(system: System) -> None:
    """Registers a system that becomes unusable in forked processes."""
    _systems.add(system)


def _in_the_child() -> None:
    global _PARENT
    for system in list(_systems):
        native: Any = system._native
        if not isinstance(native, NotHere):
            # It is never freed here: that would wait for threads that do not exist, or act in the name of the parent.
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(native))
            system._left_behind(NotHere(system.name, _PARENT))
    _PARENT = os.getpid()


os.register_at_fork(after_in_child=_in_the_child)
