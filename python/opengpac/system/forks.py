# SPDX-License-Identifier: Apache-2.0
"""A process that is forked from one with a real-time system: the system's threads are not in it, so it has no part in the system."""

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
    """Stands for a real-time system that runs in the process that this one was forked from: every call says so."""

    def __init__(self, name: str, process: int) -> None:
        self._name, self._process = name, process

    def __getattr__(self, call: str) -> NoReturn:
        where = f"system '{self._name}' runs in process {self._process}; process {os.getpid()} was forked from that and has no part in it"
        refuse(InvalidState, where, "make a system of its own here, or start processes with multiprocessing's 'spawn'")


def known(system: System) -> None:
    """Notes a system that a fork has to know of."""
    _systems.add(system)


def _in_the_child() -> None:
    global _PARENT
    for system in list(_systems):
        native: Any = system._native
        if not isinstance(native, NotHere):
            # It is never freed here: its end would wait for threads that are not there, or speak in the name of the parent.
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(native))
            system._left_behind(NotHere(system.name, _PARENT))
    _PARENT = os.getpid()


os.register_at_fork(after_in_child=_in_the_child)
