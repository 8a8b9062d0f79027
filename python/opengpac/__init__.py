# SPDX-License-Identifier: Apache-2.0
"""OpenGPAC, a general purpose automation controller: configure real-time control programs, and change them while they run.

`System` is a real-time system; `Verb` and `verb` make verbs, `Graph` a data flow graph, `LogicalDevice` a type of devices;
`library` has the blocks, `drivers` the physical devices, `robots` arms that are ready to use.
"""

import importlib
from types import ModuleType
from typing import TYPE_CHECKING

from . import drivers, library
from ._native import version as _version
from .blocks import Block, BlockUse, Occurrence, Reference
from .commands import Command, activate, deactivate, execute, install, ready, wait
from .composition import ComposedVerb, compose, together
from .conditions import Termination, on
from .devices import LogicalDevice, parameter, svv
from .errors import (
    CallError,
    CompositionConflict,
    CoverError,
    DefinitionError,
    DeviceFailed,
    EmergencyStopped,
    Error,
    InstallationErrors,
    InUse,
    InvalidState,
    ModuleError,
    NotEnabled,
    PlacementError,
    SchedulingError,
    SecondWriter,
    SynchronousCycle,
    Terminated,
    TypeMismatch,
    UnitMismatch,
    UnknownName,
    Unreachable,
    ValueRefused,
)
from .frames import Frame, Pose
from .graphs import Graph, ratio
from .groups import Group
from .instances import VerbInstance
from .modules import Module, StructType
from .parameters import each, input
from .physical import Channel, Part, PhysicalDevice
from .quantities import Quantity, deg
from .reports import Report
from .sources import Processor, Source
from .svvs import SVV, Predicate, Snapshot
from .system import System
from .verbs import Verb

from .decorated import verb  # isort: skip

if TYPE_CHECKING:
    from . import motion, robots

__version__ = _version()


def __getattr__(name: str) -> ModuleType:
    # Its definitions are checked by a real-time system: importing the package makes none.
    if name in ("motion", "robots"):
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module 'opengpac' has no attribute '{name}'")


__all__ = [
    "SVV", "Block", "BlockUse", "CallError", "Channel", "Command", "ComposedVerb", "CompositionConflict", "CoverError",
    "DefinitionError", "DeviceFailed", "EmergencyStopped", "Error", "Frame", "Graph", "Group", "InUse", "InstallationErrors",
    "InvalidState", "LogicalDevice", "Module", "ModuleError", "NotEnabled", "Occurrence", "Part", "PhysicalDevice",
    "PlacementError", "Pose", "Predicate", "Processor", "Quantity", "Reference", "Report", "SchedulingError", "SecondWriter",
    "Snapshot", "Source", "StructType", "SynchronousCycle", "System", "Terminated", "Termination", "TypeMismatch",
    "UnitMismatch", "UnknownName", "Unreachable", "ValueRefused", "Verb", "VerbInstance", "activate", "compose", "deactivate",
    "deg", "drivers", "each", "execute", "input", "install", "library", "motion", "on", "parameter", "ratio", "ready",
    "robots", "svv", "together", "verb", "wait",
]  # fmt: skip
