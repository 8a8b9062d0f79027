# SPDX-License-Identifier: Apache-2.0
"""Public names of the package, and the modules that define them.

`import opengpac` loads none of these modules: each is imported when one of its names is first used, so that the start-up time depends
only on the modules in use. The imports below are for editors and pyright; `tests/python/test_imports.py` compares them with the
table.
"""

import functools
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import cell, drivers, library, motion, robots
    from .application.instances import VerbInstance
    from .application.reports import Report
    from .definition.blocks import Block, BlockUse, Occurrence, Reference
    from .definition.commands import Command, Interval, activate, deactivate, execute, install, interval, ready, wait
    from .definition.composition import ComposedVerb, compose, together
    from .definition.conditions import Termination, on
    from .definition.files.contents import DefinitionFile
    from .definition.files.reading import load
    from .definition.files.saving import save
    from .definition.graphs import Graph, ratio
    from .definition.modules import Module, StructType
    from .definition.parameters import each, input, required
    from .definition.suspension import Holding, holding
    from .definition.verb_decorator import verb
    from .definition.verbs import Verb
    from .devices.groups import Group
    from .devices.logical import LogicalDevice, parameter, svv
    from .devices.physical import Channel, Part, PhysicalDevice
    from .devices.point import Point
    from .devices.points import Points
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
    from .policies import Policy, Term, policy
    from .python import PythonBlock, block
    from .recordings.recording import Recorded, Recording, RecordingDamage, open_recording
    from .recordings.replay import Difference, Replay, replay
    from .remote.connecting import connect
    from .studio.server import Studio
    from .symbolic import CasadiBlock, casadi
    from .system.processors import Processor
    from .system.sources import Source
    from .system.svvs import SVV, Predicate, Snapshot
    from .system.system import System
    from .system.takeover import TakenOver, TakenProcessor
    from .values.configurations import Configuration
    from .values.frames import Frame, Pose
    from .values.quantities import Quantity, deg

HOMES = {
    "application.instances": "VerbInstance",
    "application.reports": "Report",
    "definition.blocks": "Block BlockUse Occurrence Reference",
    "definition.commands": "Command Interval activate deactivate execute install interval ready wait",
    "definition.composition": "ComposedVerb compose together",
    "definition.conditions": "Termination on",
    "definition.files.contents": "DefinitionFile",
    "definition.files.reading": "load",
    "definition.files.saving": "save",
    "definition.graphs": "Graph ratio",
    "definition.modules": "Module StructType",
    "definition.parameters": "each input required",
    "definition.suspension": "Holding holding",
    "definition.verb_decorator": "verb",
    "definition.verbs": "Verb",
    "devices.groups": "Group",
    "devices.logical": "LogicalDevice parameter svv",
    "devices.physical": "Channel Part PhysicalDevice",
    "devices.point": "Point",
    "devices.points": "Points",
    "errors": (
        "AuditFailed CallError CompositionConflict ConnectionLost CoverError DefinitionError DeviceFailed EmergencyStopped "
        "Error FileFailed InstallationErrors InUse InvalidState LimitExceeded ModuleError NotAllowed NotCommanding NotEnabled "
        "NotHomed OutOfRange PlacementError SchedulingError SecondWriter SessionLost SynchronousCycle Terminated TypeMismatch "
        "UnitMismatch UnknownName Unreachable ValueRefused VersionMismatch"
    ),
    "fmi": "FmuBlock fmu",
    "policies": "Policy Term policy",
    "python": "PythonBlock block",
    "recordings.recording": "Recorded Recording RecordingDamage open_recording",
    "recordings.replay": "Difference Replay replay",
    "remote.connecting": "connect",
    "studio.server": "Studio",
    "symbolic": "CasadiBlock casadi",
    "system.processors": "Processor",
    "system.sources": "Source",
    "system.svvs": "SVV Predicate Snapshot",
    "system.system": "System",
    "system.takeover": "TakenOver TakenProcessor",
    "values.configurations": "Configuration",
    "values.frames": "Frame Pose",
    "values.quantities": "Quantity deg",
}
"""Module of each public name; a public sub-package maps to itself."""

__all__ = [
    "SVV", "AuditFailed", "Block", "BlockUse", "CallError", "CasadiBlock", "Channel", "Command", "ComposedVerb", "CompositionConflict",
    "Configuration", "ConnectionLost", "CoverError", "DefinitionError", "DefinitionFile", "DeviceFailed", "Difference", "EmergencyStopped",
    "Error", "FileFailed", "FmuBlock", "Frame", "Graph", "Group", "Holding", "InUse", "InstallationErrors", "Interval", "InvalidState",
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


@functools.cache
def homes() -> dict[str, str]:
    """Returns the module of each public name that a module defines."""
    return {name: module for module, names in HOMES.items() for name in names.split()}
