# SPDX-License-Identifier: Apache-2.0
"""The pages docs/reference.md and docs/reference, generated from docstrings, signatures and the library. Run as a program it writes
them."""

from __future__ import annotations

import argparse
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

from block_pictures import picture

import opengpac as gpac
from opengpac import cli, pytest_plugin
from opengpac.cell.verbs import SignalVerb
from opengpac.devices.logical import ParameterMember, SvvMember
from opengpac.library.components import Component
from opengpac.library.manuals import manual
from opengpac.library.origins import standard

PAGE = Path(__file__).parent.parent.parent / "docs" / "reference.md"
FOLDER = PAGE.parent / "reference"

MODULES = [
    "opengpac",
    "opengpac.motion",
    "opengpac.robots",
    "opengpac.cell",
    "opengpac.library",
    "opengpac.drivers",
    "opengpac.system.alarms",
    "opengpac.gym",
]
"""Modules whose public names are on the page: the names in `__all__`, or else those that the module itself defines."""

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
    "Quantities, poses, points": ("opengpac", "Quantity deg Pose Frame Configuration Point Points"),
    "Errors": (
        "opengpac",
        "Error InstallationErrors AuditFailed CallError CompositionConflict ConnectionLost CoverError DefinitionError DeviceFailed "
        "EmergencyStopped FileFailed InUse InvalidState LimitExceeded ModuleError NotAllowed NotCommanding NotEnabled NotHomed OutOfRange "
        "PlacementError SchedulingError SecondWriter SessionLost SynchronousCycle TypeMismatch UnitMismatch UnknownName Unreachable "
        "ValueRefused VersionMismatch",
    ),
    "Motions": (
        "opengpac.motion",
        "move_absolute move_relative move_velocity stop jog jog_linear home home_here gear move_linear move_circular follow_linear follow "
        "carry follow_long follow_linear_long speeds return_to_range "
        "Moved Stopped Homed MoveTimeout LimitReached TimeLost HomingFailed LineRefused ArcRefused PathRefused JogBlocked",
    ),
    "Queues of moves": (
        "opengpac.motion",
        "MoveQueue at move_queue move_queue_switching QueueReport MoveEnd MoveRefused",
    ),
    "Arms and grippers": (
        "opengpac.robots",
        "load Arm Joint joint_servo joint_decoupled_servo joint_follower "
        "move Moved MotionTimeout FollowingError ServoUnstable Payload Kinematics Axis Dynamics Link Interfaces gripper Finger "
        "finger_servo finger_follower tool_by_touching TouchedTool identify_payload IdentifiedPayload",
    ),
    "Signals of a cell": (
        "opengpac.cell",
        "DigitalInput DigitalOutput AnalogInput AnalogOutput set_output pulse wait_for_input InputTimeout",
    ),
    "Alarms": ("opengpac.system.alarms", "Alarms Alarm Shelving"),
    "Forced signals": ("opengpac.system.forcing", "Force ForcedSignal"),
    "Workspaces": ("opengpac.studio.workspaces", "Workspaces"),
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
"""Groups of names: title → the module, and its names in the order of the page."""

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
    "Dynamics",
    "Axis",
    "DigitalInput",
    "DigitalOutput",
    "AnalogInput",
    "AnalogOutput",
]
"""Classes that a program instantiates; objects of other classes come from calls of the system."""

ALIASES = {"Quantity": "opengpac.values.quantities", "Command": "opengpac.definition.commands", "Frame": "opengpac.values.frames"}
"""Type aliases: name → the module that defines it."""

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
"""Members that are public only for other modules of the package."""

HEAD = """# Reference

This page lists every public name of `import opengpac as gpac` with the first sentence of its description. Each heading leads to a page with
signatures, units, errors and examples, which are the docstrings as `help(gpac.Verb)` shows them.

| also | page |
|---|---|
| every block of the library, with ports, units, ranges and faults | [by category](#blocks-of-the-library) |
| every command of the shell, with its options | [commands](reference/commands.md) |
| every word of a block's declaration, in C and Rust | [function blocks](blocks.md) |
| every call on a real-time system, for C and over the network | [the calls](calls.md), [the control interface](control.md) |
| graphs, verbs and device types as files | [files](files.md) |
"""


def slug(title: str) -> str:
    """Returns the file name for a title."""
    return re.sub(r"\W+", "-", title.lower()).strip("-")


def public(module: ModuleType) -> list[str]:
    """Returns the public names of a module."""
    if hasattr(module, "__all__"):
        return [name for name in module.__all__ if not inspect.ismodule(getattr(module, name))]
    return [n for n, found in vars(module).items() if not n.startswith("_") and getattr(found, "__module__", "") == module.__name__]


def pages() -> dict[Path, str]:
    """Returns every generated page: path → text."""
    made = {PAGE: page(), FOLDER / "commands.md": commands()}
    for title in GROUPS:
        made[FOLDER / f"{slug(title)}.md"] = module_page(title)
    for category, components in categories().items():
        drawn = {c.name: drawing for c in components if (drawing := picture(c))}
        made |= {FOLDER / f"{name}.svg": drawing for name, drawing in drawn.items()}
        made[FOLDER / f"blocks-{slug(category)}.md"] = category_page(category, components, {*drawn})
    return made


def page() -> str:
    """Returns the index: a line for every name."""
    parts = [HEAD]
    for title, (module, names) in GROUPS.items():
        found = importlib.import_module(module)
        parts.append(f"\n## [{title}](reference/{slug(title)}.md)\n\n{of_module(module)}")
        parts += [f"- **`{name}`** {first(documentation(getattr(found, name), name))}\n" for name in names.split()]
    parts.append("\n## Blocks of the library\n\nWith the graphs, verbs and device types that come with them.\n\n")
    for category, components in categories().items():
        parts.append(f"- [{category}](reference/blocks-{slug(category)}.md): {', '.join(f'`{c.name}`' for c in components)}.\n")
    return "".join([*parts, *shell()])


def of_module(module: str) -> str:
    """Returns the line that states the module of names outside the package itself."""
    return "" if module == "opengpac" else f"In `{module.replace('opengpac', 'gpac', 1)}`.\n\n"


def module_page(title: str) -> str:
    """Returns the page of a group of names: signature, docstring and members of each."""
    module, names = GROUPS[title]
    found = importlib.import_module(module)
    return (
        "".join([f"# {title}\n\n{of_module(module)}", *(part for name in names.split() for part in section(found, name))]).rstrip() + "\n"
    )


def section(module: ModuleType, name: str) -> Iterator[str]:
    """Yields the section of a name, with one for each member if it is a class."""
    found = getattr(module, name)
    called = name in MADE_BY_YOU or not (isinstance(found, type) or name in ALIASES)
    yield f"## {name}\n\n"
    if called and (call := signature(found)):
        yield f"```python\n{wrapped(name + call)}\n```\n\n"
    yield f"{markdown(documentation(found, name))}\n\n"
    if not isinstance(found, type) or name in ALIASES or issubclass(found, Exception):
        return
    if issubclass(found, gpac.LogicalDevice) and (lines := "".join(line.removeprefix("  ") for line in device_members(found))):
        yield f"{lines}\n"
    for member, call, said in members(found):
        yield f"### {name}.{member}\n\n"
        if call:
            yield f"```python\n{wrapped(member + call)}\n```\n\n"
        yield f"{markdown(said)}\n\n"


def wrapped(call: str) -> str:
    """Returns a call in Python's syntax, with each argument on its own line if it is long."""
    call = call.replace("…", "...")
    if len(call) <= 100:
        return call
    head, _, rest = call.partition("(")
    depth, arguments, begin = 0, list[str](), 0
    for place, letter in enumerate(rest):
        depth += (letter in "([{") - (letter in ")]}")
        if depth == -1 or (letter == "," and depth == 0):
            arguments.append(rest[begin:place].strip())
            begin = place + 1
    return f"{head}(\n" + "".join(f"    {argument},\n" for argument in arguments) + ")"


def markdown(doc: str) -> str:
    """Returns a docstring with its examples as listings."""
    parts = doc.strip().split("\n\n")
    return "\n\n".join(f"```pycon\n{part}\n```" if part.startswith(">>> ") else part for part in parts)


def categories() -> dict[str, list[Component]]:
    """Returns the components of the standard library by category."""
    found = sorted((c for c in standard() if isinstance(c, Component)), key=lambda c: (c.category, c.name))
    return {category: [*group] for category, group in itertools.groupby(found, key=lambda c: c.category)}


def category_page(category: str, components: list[Component], drawn: set[str]) -> str:
    """Returns the page of a category: the manual of each component, as `opengpac blocks show` prints it, and its picture if it has one."""
    about = " Pictures show the first output for a step and a ramp of the input, with the defaults." if drawn else ""
    parts = [f"# Library: {category}\n\nAs `opengpac blocks show NAME` prints it.{about}\n"]
    for component in components:
        _, _, text = str(manual(component)).partition("\n\n")
        kind = "" if component.kind == "block" else f"*{component.kind}*\n\n"
        if component.name in drawn:
            kind += f"![{component.name}: its answer to a step and a ramp]({component.name}.svg)\n\n"
        parts.append(f"\n## {component.name}\n\n{kind}```text\n{text.rstrip()}\n```\n")
    return "".join(parts)


def commands() -> str:
    """Returns the page of the shell commands, with their options."""
    parts = ["# Commands\n\nEvery command of `opengpac` with its words and options; `opengpac COMMAND --help` prints them too.\n"]
    return "".join([*parts, *command("opengpac", cli._parser(), 1)])


def command(name: str, parser: argparse.ArgumentParser, depth: int) -> Iterator[str]:
    """Yields the sections of a command and of its subcommands."""
    rows = []
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            said = {choice.dest: choice.help or "" for choice in action._choices_actions}
            for word, below in action.choices.items():
                yield f"\n{'#' * min(depth + 1, 4)} {name} {word}\n\n{sentence(said.get(word, ''))}\n"
                yield from command(f"{name} {word}", below, depth + 1)
        elif action.help is not argparse.SUPPRESS and not isinstance(action, argparse._HelpAction):
            rows.append(f"| {spelt(action)} | {sentence(meaning(parser, action)).replace('|', chr(92) + '|')} |\n")
    if rows:
        yield "".join(["\n| word | meaning |\n|---|---|\n", *rows])


def spelt(action: argparse.Action) -> str:
    """Returns an option or argument as it is typed."""
    value = "" if action.nargs == 0 else str(action.metavar or "\\|".join(map(str, action.choices or ())) or action.dest.upper())
    words = [f"{option} {value}".strip() for option in action.option_strings] or [value]
    return ", ".join(f"`{word}`" for word in words)


def meaning(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    """Returns the help of an option, with its default filled in."""
    values = {**vars(action), "prog": parser.prog}
    return (action.help or "") % values


def sentence(text: str) -> str:
    """Returns a text with a capital first letter and a full stop at the end."""
    return text and f"{text[0].upper()}{text[1:]}".rstrip(".") + "."


def shell() -> Iterator[str]:
    """Yields the commands of `opengpac`, and the fixtures for pytest."""
    yield "\n## [At the shell](reference/commands.md), and in pytest\n\n"
    for action in cli._parser()._actions:
        for found in getattr(action, "_choices_actions", ()):
            yield f"- **`opengpac {found.dest}`** {found.help[0].upper()}{found.help[1:]}.\n"
    for fixture in ("cell", "real_cell"):
        yield f"- **`{fixture}`**, a fixture: {first(fixtures()[fixture])}\n"


def fixtures() -> dict[str, str]:
    """Returns the docstrings of the fixtures, read from the source: in some versions pytest's fixture objects have none."""
    body = ast.parse(inspect.getsource(pytest_plugin)).body
    return {found.name: ast.get_docstring(found) or "" for found in body if isinstance(found, ast.FunctionDef)}


def device_members(kind: type[gpac.LogicalDevice]) -> Iterator[str]:
    """Yields the SVVs and parameters of a device type, one line each, with units and defaults."""
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


def members(kind: type) -> Iterator[tuple[str, str, str]]:
    """Yields the documented methods and properties of a class: name, call and docstring; inherited ones are listed with their base."""
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
            yield name, call, inspect.getdoc(made) or ""


def signature(found: Any, bound: bool = False) -> str:
    """Returns the parameters of a call, with types and defaults; for a verb those of its call."""
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
    """Text that is shown without quotes."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return self.text


def default(value: Any) -> Any:
    """Returns a default in readable form; `…` if it has none."""
    if value is inspect.Parameter.empty or value is None or isinstance(value, bool | int | float | str | tuple):
        return value
    return _As("…")


def written(annotation: Any) -> Any:
    """Returns a type as written in the source, without the underscore of a private name."""
    if annotation is inspect.Parameter.empty:
        return annotation
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    return _As(re.sub(r"(?<![\w.])_(?=[A-Z])", "", text))


def documentation(found: Any, name: str) -> str:
    """Returns the docstring of a name; for an alias the one below its assignment."""
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
    """Returns the first paragraph of a docstring, as one line."""
    return re.sub(r"\s+", " ", doc.split("\n\n")[0]).strip()


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for old in FOLDER.iterdir():
        old.unlink()
    for path, text in pages().items():
        path.write_text(text)
