# SPDX-License-Identifier: Apache-2.0
"""The page docs/reference.md, made from the docstrings and signatures of the public names. Run as a program it writes the page."""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import opengpac as gpac
from opengpac import cli, pytest_plugin
from opengpac.cell.verbs import SignalVerb
from opengpac.devices import ParameterMember, SvvMember

PAGE = Path(__file__).parent.parent.parent / "docs" / "reference.md"

MODULES = [
    "opengpac",
    "opengpac.motion",
    "opengpac.robots",
    "opengpac.cell",
    "opengpac.library",
    "opengpac.drivers",
    "opengpac.alarms",
    "opengpac.gym",
]
"""The modules whose public names the page has. Those without `__all__` have what they define themselves."""

GROUPS: dict[str, tuple[str, str]] = {
    "Systems": (
        "opengpac",
        "System TakenOver TakenProcessor connect Processor Source PhysicalDevice Part Channel SVV Snapshot Predicate Module StructType "
        "Studio",
    ),
    "Recordings and replay": ("opengpac", "Recording open_recording Recorded RecordingDamage replay Replay Difference"),
    "Definitions in files": ("opengpac", "load save DefinitionFile"),
    "Blocks and graphs": ("opengpac", "Block BlockUse Occurrence Reference Graph ratio block PythonBlock"),
    "Items of a block in Python": ("opengpac.python", "Input Output State Parameter Condition Invocation"),
    "Learned policies": ("opengpac", "policy Policy Term"),
    "Symbolic models and FMUs": ("opengpac", "casadi CasadiBlock fmu FmuBlock"),
    "Episodes": ("opengpac.gym", "Environment Task Values side_by_side"),
    "Verbs": ("opengpac", "Verb verb VerbInstance Report Terminated"),
    "Tables of a verb": ("opengpac", "each input required on Termination holding Holding"),
    "Commands of a list": ("opengpac", "activate execute deactivate wait install ready interval Interval Command"),
    "Composition": ("opengpac", "compose together ComposedVerb"),
    "Logical devices": ("opengpac", "LogicalDevice svv parameter Group"),
    "Quantities, poses, points": ("opengpac", "Quantity deg Pose Frame Point Points"),
    "Errors": (
        "opengpac",
        "Error InstallationErrors AuditFailed CallError CompositionConflict ConnectionLost CoverError DefinitionError DeviceFailed "
        "EmergencyStopped FileFailed InUse InvalidState LimitExceeded ModuleError NotAllowed NotCommanding NotEnabled NotHomed OutOfRange "
        "PlacementError SchedulingError SecondWriter SessionLost SynchronousCycle TypeMismatch UnitMismatch UnknownName Unreachable "
        "ValueRefused VersionMismatch",
    ),
    "Motions": (
        "opengpac.motion",
        "move_absolute move_relative move_velocity stop jog home home_here gear move_linear follow_linear follow carry "
        "follow_long follow_linear_long speeds "
        "Moved Stopped Homed MoveTimeout LimitReached TimeLost HomingFailed LineRefused PathRefused",
    ),
    "Arms and grippers": (
        "opengpac.robots",
        "load Arm Joint joint_servo joint_decoupled_servo joint_follower "
        "move Moved MotionTimeout FollowingError ServoUnstable Payload Kinematics Axis Interfaces gripper Finger "
        "finger_servo finger_follower",
    ),
    "Signals of a cell": (
        "opengpac.cell",
        "DigitalInput DigitalOutput AnalogInput AnalogOutput set_output pulse wait_for_input InputTimeout",
    ),
    "Alarms": ("opengpac.alarms", "Alarms Alarm Shelving"),
    "Workspaces": ("opengpac.workspaces", "Workspaces"),
    "Sessions with a remote system": ("opengpac.remote.session", "Session Commanding CommandRequest"),
    "The component data base": (
        "opengpac.library",
        "list search show get block blocks add problems refresh padded Component Found Manual Problem",
    ),
    "Drivers": (
        "opengpac.drivers",
        "mujoco loopback scripted plant_process python ethercat canopen ur modbus modbus_server text feetech dynamixel fmu load list show "
        "manuals scan Driver Drivers Manual Manuals Found",
    ),
}
"""Title → the module, and its names in the order of the page."""

MADE_BY_YOU = [
    "System",
    "Verb",
    "Graph",
    "Group",
    "LogicalDevice",
    "Points",
    "Pose",
    "Arm",
    "Joint",
    "Finger",
    "Payload",
    "Kinematics",
    "Axis",
    "DigitalInput",
    "DigitalOutput",
    "AnalogInput",
    "AnalogOutput",
]
"""The classes that a program calls; others come from calls of the system."""

ALIASES = {"Quantity": "opengpac.quantities", "Command": "opengpac.commands", "Frame": "opengpac.frames"}
"""Names of types that are written otherwise: name → the module that says so."""

FOR_OPENGPAC = [
    "json",
    "text",
    "source_json",
    "own_system",
    "own_systems",
    "refused_call",
    "reported",
    "report_class",
    "termination",
    "definition_json",
    "definition_name",
    "definition_verb",
    "parameter_members",
    "svv_members",
]
"""Members that are public for other modules of the package only."""

HEAD = """# Reference

Every public name with its signature and first words. This page is made from the docstrings, which say more: `help(gpac.Verb)`. Blocks
are in [the library](library.md), or `opengpac blocks show NAME`; the words of a block's declaration in [blocks](blocks.md). The
[guide](guide.md) shows what they are for.
"""


def public(module: ModuleType) -> list[str]:
    """The public names of a module."""
    if hasattr(module, "__all__"):
        return [name for name in module.__all__ if not inspect.ismodule(getattr(module, name))]
    return [n for n, found in vars(module).items() if not n.startswith("_") and getattr(found, "__module__", "") == module.__name__]


def page() -> str:
    """The whole page."""
    parts = [HEAD]
    for title, (module, names) in GROUPS.items():
        found = importlib.import_module(module)
        parts.append(f"\n## {title}\n\n" + ("" if module == "opengpac" else f"In `{module.replace('opengpac', 'gpac', 1)}`.\n\n"))
        parts += [line for name in names.split() for line in entry(found, name)]
    return "".join([*parts, *shell()])


def shell() -> Iterator[str]:
    """The commands of `opengpac`, and the fixtures for pytest."""
    yield "\n## At the shell, and in pytest\n\n"
    for action in cli._parser()._actions:
        for command in getattr(action, "_choices_actions", ()):
            yield f"- **`opengpac {command.dest}`** {command.help[0].upper()}{command.help[1:]}.\n"
    for fixture in ("cell", "real_cell"):
        yield f"- **`{fixture}`**, a fixture: {first(fixtures()[fixture])}\n"


def fixtures() -> dict[str, str]:
    """The docstrings of the fixtures: what pytest makes of a fixture has none in some of its versions."""
    body = ast.parse(inspect.getsource(pytest_plugin)).body
    return {found.name: ast.get_docstring(found) or "" for found in body if isinstance(found, ast.FunctionDef)}


def entry(module: ModuleType, name: str) -> Iterator[str]:
    """The line of a name, and of a class those of its own members."""
    found = getattr(module, name)
    called = name in MADE_BY_YOU or not (isinstance(found, type) or name in ALIASES)
    yield f"- **`{name}{signature(found) if called else ''}`** {first(documentation(found, name))}\n"
    if isinstance(found, type) and name not in ALIASES and not issubclass(found, Exception):
        yield from device_members(found) if issubclass(found, gpac.LogicalDevice) else ()
        yield from (f"  - `{member}` {said}\n" for member, said in members(found))


def device_members(kind: type[gpac.LogicalDevice]) -> Iterator[str]:
    """The SVVs and the parameters of a device type, each in one line, with units and defaults."""
    svvs = [f"`{n}`" + (f" ({m.unit})" if m.unit else "") for n, m in vars(kind).items() if isinstance(m, SvvMember)]
    parameters = [
        f"`{name}` ({' '.join(filter(None, [f'{m.default:g}' if isinstance(m.default, float) else str(m.default), m.unit]))}"
        f"{', tunable' if m.tunable else ''})"
        for name, m in vars(kind).items()
        if isinstance(m, ParameterMember)
    ]
    for what, found in (("SVVs", svvs), ("parameters, with their defaults", parameters)):
        if found:
            yield f"  - {what}: {', '.join(found)}.\n"


def members(kind: type) -> Iterator[tuple[str, str]]:
    """The documented methods and properties of a class, and what is said of them; those of a base stand with that base."""
    on_page = {
        getattr(importlib.import_module(module), name) for module, names in GROUPS.values() for name in names.split() if name != "Command"
    }
    seen: set[str] = {*FOR_OPENGPAC}
    for base in kind.__mro__:
        if not base.__module__.startswith("opengpac") or (base is not kind and base in on_page):
            continue
        for name, value in vars(base).items():
            made = getattr(value, "__func__", value)
            wanted = inspect.isfunction(made) or isinstance(made, property | functools.cached_property)
            if name.startswith("_") or name in seen or not wanted or not inspect.getdoc(made):
                continue
            seen.add(name)
            call = signature(made, bound=not isinstance(value, staticmethod)) if inspect.isfunction(made) else ""
            yield name + call, first(inspect.getdoc(made) or "")


def signature(found: Any, bound: bool = False) -> str:
    """What stands in the parentheses of a call, with types and defaults; of a verb that of its call."""
    if isinstance(found, SignalVerb):
        return "(signal, …)"
    given = getattr(found, "signature", None)
    try:
        given = given if isinstance(given, inspect.Signature) else inspect.signature(found)
    except (TypeError, ValueError):
        return ""
    parameters = [*given.parameters.values()][1 if bound else 0 :]
    text = str(
        given.replace(
            parameters=[p.replace(annotation=written(p.annotation), default=default(p.default)) for p in parameters],
            return_annotation=inspect.Signature.empty,
        )
    )
    return re.sub(r"\s+", " ", text)


class _As:
    """A text that is shown without quotes."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return self.text


def default(value: Any) -> Any:
    """A default as a person writes it; what has no such form is `…`."""
    if value is inspect.Parameter.empty or value is None or isinstance(value, bool | int | float | str | tuple):
        return value
    return _As("…")


def written(annotation: Any) -> Any:
    """A type as it is written in the source, without the mark of a private name."""
    if annotation is inspect.Parameter.empty:
        return annotation
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    return _As(re.sub(r"(?<![\w.])_(?=[A-Z])", "", text))


def documentation(found: Any, name: str) -> str:
    """The docstring of a name; of an alias the one that stands below its assignment."""
    if name not in ALIASES:
        return inspect.getdoc(found) or ""
    body = ast.parse(inspect.getsource(importlib.import_module(ALIASES[name]))).body
    for assigned, below in itertools.pairwise(body):
        targets = [assigned.target] if isinstance(assigned, ast.AnnAssign) else getattr(assigned, "targets", [])
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            assert isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
            return str(below.value.value)
    return ""


def first(doc: str) -> str:
    """The first paragraph of a docstring, as one line."""
    return re.sub(r"\s+", " ", doc.split("\n\n")[0]).strip()


if __name__ == "__main__":
    PAGE.write_text(page())
