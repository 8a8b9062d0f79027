# SPDX-License-Identifier: Apache-2.0
"""The public names of the package, from the modules that define them. `__init__.py` loads them."""

from typing import TYPE_CHECKING

from . import drivers, library
from .adoption import TakenOver, TakenProcessor
from .blocks import Block, BlockUse, Occurrence, Reference
from .commands import Command, Interval, activate, deactivate, execute, install, interval, ready, wait
from .composition import ComposedVerb, compose, together
from .conditions import Termination, on
from .devices import LogicalDevice, parameter, svv
from .errors import (
    AuditFailed,
    CallError,
    CompositionConflict,
    ConnectionLost,
    CoverError,
    DefinitionError,
    DeviceFailed,
    EmergencyStopped,
    Error,
    FileFailed,
    InstallationErrors,
    InUse,
    InvalidState,
    LimitExceeded,
    ModuleError,
    NotAllowed,
    NotCommanding,
    NotEnabled,
    NotHomed,
    OutOfRange,
    PlacementError,
    SchedulingError,
    SecondWriter,
    SessionLost,
    SynchronousCycle,
    Terminated,
    TypeMismatch,
    UnitMismatch,
    UnknownName,
    Unreachable,
    ValueRefused,
    VersionMismatch,
)
from .fmi import FmuBlock, fmu
from .frames import Frame, Pose
from .graphs import Graph, ratio
from .groups import Group
from .instances import VerbInstance
from .modules import Module, StructType
from .parameters import each, input, required
from .physical import Channel, Part, PhysicalDevice
from .points import Point, Points
from .policies import Policy, Term, policy
from .processors import Processor
from .python import PythonBlock, block
from .quantities import Quantity, deg
from .recordings import Recorded, Recording, RecordingDamage, open_recording
from .remote.connecting import connect
from .replaying import Difference, Replay, replay
from .reports import Report
from .sources import Source
from .studio import Studio
from .suspension import Holding, holding
from .svvs import SVV, Predicate, Snapshot
from .symbolic import CasadiBlock, casadi
from .system import System
from .verbs import Verb

from .decorated import verb  # isort: skip
from .definitions.contents import DefinitionFile
from .definitions.reading import load

from .definitions.saving import save  # isort: skip

if TYPE_CHECKING:
    from . import cell, motion, robots

__all__ = [
    "SVV", "AuditFailed", "Block", "BlockUse", "CallError", "CasadiBlock", "Channel", "Command", "ComposedVerb", "CompositionConflict",
    "ConnectionLost", "CoverError", "DefinitionError", "DefinitionFile", "DeviceFailed", "Difference", "EmergencyStopped", "Error",
    "FileFailed", "FmuBlock", "Frame", "Graph", "Group", "Holding", "InUse", "InstallationErrors", "Interval", "InvalidState",
    "LimitExceeded", "LogicalDevice", "Module", "ModuleError", "NotAllowed", "NotCommanding", "NotEnabled", "NotHomed", "Occurrence",
    "OutOfRange", "Part", "PhysicalDevice", "PlacementError", "Point", "Points", "Policy", "Pose", "Predicate", "Processor",
    "PythonBlock", "Quantity", "Recorded", "Recording", "RecordingDamage", "Reference", "Replay",
    "Report", "SchedulingError", "SecondWriter", "SessionLost",
    "Snapshot", "Source", "StructType", "Studio", "SynchronousCycle", "System", "TakenOver", "TakenProcessor", "Term", "Terminated",
    "Termination", "TypeMismatch", "UnitMismatch", "UnknownName", "Unreachable", "ValueRefused", "Verb", "VerbInstance",
    "VersionMismatch", "activate", "block", "casadi", "cell", "compose", "connect", "deactivate", "deg", "drivers", "each", "execute",
    "fmu", "holding", "input", "install", "interval", "library", "load", "motion", "on", "open_recording", "parameter", "policy", "ratio",
    "ready", "replay", "required", "robots", "save", "svv", "together", "verb", "wait",
]  # fmt: skip
