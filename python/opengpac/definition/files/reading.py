# SPDX-License-Identifier: Apache-2.0
"""Reads a definition file: parses it, checks it against the schema, resolves names, has the model check it, and reports all errors at
once."""

from __future__ import annotations

import importlib
import json
import os
import types
from collections.abc import Callable, Mapping
from pathlib import Path as File
from typing import TYPE_CHECKING, Any, TypeAlias

from ... import library
from ...devices.logical import LogicalDevice, parameter, svv
from ...errors import (
    REFUSALS,
    DefinitionError,
    Error,
    FileFailed,
    Terminated,
    UnknownName,
    did_you_mean,
    from_refusals,
    refusals,
    several,
)
from ...refusals.argument_types import taking
from ...refusals.source_location import Place
from ...storage.files import read
from .. import entering
from ..blocks import Block, BlockUse, systems_of
from ..composition import ComposedVerb, compose, together
from ..conditions import Termination
from ..graphs import Graph
from ..modules import Module
from ..parameters import InputParameter, Object, Requirement, absent
from ..suspension import Holding
from ..verbs import Verb
from .contents import DefinitionFile
from .form import Finding, findings
from .making import LoadedGraph, LoadedVerb, Origin, part_of, placed
from .naming import Given, Names
from .parsing import error_of, is_toml, parsed
from .positions import Path, lines_of
from .shortening import long
from .trees import KINDS, Tree

if TYPE_CHECKING:
    from ...system.system import System

_PACKAGE = __name__.split(".", 1)[0]

Devices: TypeAlias = "Mapping[str, type[LogicalDevice]] | list[type[LogicalDevice]] | None"


@taking
def load(
    path: str | os.PathLike[str],
    *,
    system: System | None = None,
    modules: Mapping[str, Module] | None = None,
    raises: Given = None,
    devices: Devices = None,
    forms: Given = None,
) -> DefinitionFile:
    """Loads the definitions of the TOML or JSON file at `path`: `shapes = gpac.load("shapes.toml")`, then `shapes.smooth`.

    No part of the file is executed. Exception classes that its conditions name come from this package, or from the caller:
    `raises={"Collision": Collision}`, or a list of classes. The caller can pass device types in `devices` and functions in `forms` in
    the same way. Code modules are passed in `modules={"press": code}`; with a `system`, the modules that the file names are
    downloaded to it. All errors are raised at once, with lines of the file.
    """
    made, errors = read_file(path, system=system, modules=modules, raises=raises, devices=devices, forms=forms)
    if errors:
        raise errors[0] if len(errors) == 1 else several(errors)
    return made


def read_file(path: str | os.PathLike[str], *, stand_in: bool = False, **given: Any) -> tuple[DefinitionFile, list[Error]]:
    """Like `load`, but returns the errors together with the definitions that could be created. With `stand_in`, invents missing
    exception classes."""
    file = File(path).expanduser()
    text = read(file, "the file of definitions")
    if text is None:
        raise FileFailed(f"file '{file}' does not exist", place=Place(str(file), 1))
    toml = is_toml(file)
    tree = parsed(file, text, toml)
    lines = lines_of(text, toml)
    wrong = findings(tree)
    if wrong:
        return DefinitionFile(file, {}), [error_of(finding, file, lines) for finding in wrong]
    reading = _Reading(file, tree, lines, stand_in, **given)
    reading.read()
    return reading.made, reading.errors


class _Skipped(Exception):
    """Raised if a dependency is invalid and its error has already been recorded."""


class _Reading:
    """Reader state for one file; each definition is created on first use."""

    def __init__(
        self, file: File, tree: Tree, lines: dict[Path, int], stand_in: bool,
        system: System | None = None, modules: Mapping[str, Module] | None = None, raises: Given = None, devices: Devices = None,
        forms: Given = None,
    ) -> None:  # fmt: skip
        self.file, self.lines, self.errors = file, lines, []
        self.trees: dict[str, dict[str, Tree]] = {kind: dict(tree.get(kind, {})) for kind in KINDS}
        self.made = DefinitionFile(file, tree)
        self.system, self.modules, self.stand_in = system, dict(modules or {}), stand_in
        self.raises, self.forms, self.devices = Names(raises, Terminated), Names(forms, None), Names(_by_name(devices), LogicalDevice)
        self._found: dict[tuple[str, str], Any] = {}
        self._open: list[tuple[str, str]] = []

    errors: list[Error]

    def read(self) -> None:
        """Creates all definitions of the file."""
        names: dict[str, str] = {}
        self._download()
        for kind in KINDS:
            for key in self.trees[kind]:
                if key in names:
                    self.refuse(
                        DefinitionError,
                        (kind, key),
                        f"'{key}' is defined twice, in {names[key]} and in {kind}",
                        "give them different names",
                    )
                    continue
                names[key] = kind
                try:
                    self.made._made[key] = self.of(kind, key)
                except _Skipped:
                    continue

    def refuse(self, kind: type[Error], path: Path, message: str, remedy: str = "") -> None:
        """Records an error at a path of the file."""
        self.errors.append(error_of(Finding(kind, path, message, remedy), self.file, self.lines))

    def _download(self) -> None:
        for name, path in self.made.modules.items():
            if name in self.modules or self.system is None:
                continue
            try:
                self.modules[name] = self.system.download(str(self.file.absolute().parent / path), name)
            except (Error, OSError) as error:
                self.refuse(FileFailed, ("modules", name), f"code module '{name}' cannot be downloaded: {str(error).splitlines()[0]}")

    def of(self, kind: str, key: str) -> Any:
        """Returns a definition of the file; creates it on first use."""
        at = (kind, key)
        if at not in self._found:
            if at in self._open:
                names = " → ".join(name for _, name in [*self._open[self._open.index(at) :], at])
                self.refuse(DefinitionError, at, f"definitions form a cycle: {names}", "remove one of these references")
                raise _Skipped
            self._open.append(at)
            try:
                self._found[at] = self._make(kind, key)
            finally:
                self._open.pop()
                self._found.setdefault(at, None)
        if self._found[at] is None:
            raise _Skipped
        return self._found[at]

    def _make(self, kind: str, key: str) -> Any:
        origin = Origin(str(self.file), self.lines, (kind, key))
        before = len(self.errors)
        tree: Tree = {}
        try:
            tree = long(kind, key, self.trees[kind][key])
            make: Callable[[Tree, Origin], Any] = {
                "graphs": self._graph, "verbs": self._verb, "device_types": self._device_type, "compositions": self._composed,
            }[kind]  # fmt: skip
            made = make(tree, origin)
        except Error as error:
            self._note(error, tree, origin)
            raise _Skipped from None
        if len(self.errors) > before:
            raise _Skipped
        if tree.get("layout") and not isinstance(made, type):
            made.layout = tree["layout"]
        return made

    def _note(self, error: Error, tree: Tree, origin: Origin) -> None:
        """Adds errors, each with the line of the part that it concerns."""
        for one in getattr(error, "errors", [error]):
            if one.where and tree:
                one.place = origin.place(*part_of(tree, one.where))
            elif one.place is None or one.place.file != origin.file:
                one.place = origin.place()
            if not any((type(one), str(one)) == (type(known), str(known)) for known in self.errors):
                self.errors.append(one)

    # ---- blocks ----

    def _uses(self, tree: Tree, origin: Origin) -> dict[str, BlockUse]:
        """Returns the blocks by label. Omits unknown blocks; the model refuses references to them."""
        uses: dict[str, BlockUse] = {}
        for label, use in tree["blocks"].items():
            block = self._block(use["block"], (*origin.path, "blocks", label), origin)
            if block is not None:
                uses[label] = BlockUse(block, use["constants"], origin.place("blocks", label))
        return uses

    def _block(self, source: Tree, path: Path, origin: Origin) -> Block | Graph | None:
        if "graph" in source:
            inner = {"name": "", "doc": ""} | source["graph"]
            made = self._graph(inner, Origin(origin.file, self.lines, path))
            made.layout = inner.get("layout", {})
            return made
        name: str = source["subroutine"]
        module, dot, short = name.partition(".")
        if not dot:
            if name in self.trees["graphs"]:
                return self.of("graphs", name)
            known = [*self.trees["graphs"], *(f"library.{short}" for short in library.blocks())]
            near = (
                did_you_mean(name, known)
                if did_you_mean(name, known).startswith("did")
                else "write a dot for a block of a module: library.pid"
            )
            self.refuse(UnknownName, path, f"this file has no graph '{name}'", near)
            return None
        try:
            if module in self.modules:
                return self.modules[module][short]
            return library.block(name)
        except Error as error:
            if module in self.made.modules:
                remedy = f"pass the system to which it is downloaded, gpac.load(…, system=cell), or pass modules={{'{module}': code}}"
                self.refuse(UnknownName, path, f"code module '{module}' is not loaded", remedy)
            else:
                self.refuse(type(error), path, error.message, error.remedy)
            return None

    # ---- definitions ----

    def _definitions(self, uses: Mapping[str, BlockUse]) -> entering.Definitions:
        system = next(iter(systems_of(uses.values())), self.system)
        return system._definitions if system is not None else entering.without_system()

    def _checked(self, kind: str, drawn: Tree, uses: Mapping[str, BlockUse], device_types: list[type[LogicalDevice]]) -> None:
        """Runs all checks of the model at once."""
        definitions = self._definitions(uses)
        definitions.enter_modules(uses.values())
        for device_type in device_types:
            definitions.enter_device_type(device_type)
        with refusals:
            found = definitions.native.check_definition({kind: drawn})
        if found:
            raise from_refusals(json.dumps(found))

    def _graph(self, tree: Tree, origin: Origin) -> Graph:
        before = len(self.errors)
        uses = self._uses(tree, origin)
        drawn = placed("graphs", tree, origin)
        drawn["blocks"] = {label: use.json() for label, use in uses.items()}
        if len(self.errors) > before:
            raise _Skipped
        self._checked("graph", drawn, uses, [])
        given = {key: tree[key] for key in ("name", "doc", "inputs", "outputs", "cells", "modes", "divide")}
        return LoadedGraph(origin, blocks=uses, **given)

    def _verb(self, tree: Tree, origin: Origin) -> Verb[..., Any]:
        before = len(self.errors)
        uses = self._uses(tree, origin)
        objects = {name: self._object(given, (*origin.path, "objects", name)) for name, given in tree["objects"].items()}
        conditions = {name: self._termination(name, given, origin) for name, given in tree["conditions"].items()}
        inputs = {name: self._input(name, given, origin) for name, given in tree["input_parameters"].items()}
        if len(self.errors) > before:
            raise _Skipped
        drawn = placed("verbs", tree, origin)
        drawn["blocks"] = {label: use.json() for label, use in uses.items()}
        drawn["input_parameters"] = {name: given.json() for name, given in inputs.items()}
        self._checked("verb", drawn, uses, [obj.device_type for obj in objects.values() if obj is not None])
        suspend = tree["suspend"]
        if isinstance(suspend, dict):
            ways = suspend["holding"]
            suspend = Holding(tuple(way["set"] for way in ways), tuple(way["until"] for way in ways))
        requires = {
            name: Requirement(_refusal(given["raises"]), given["when"], given["remedy"], origin.place("requires", name))
            for name, given in tree["requires"].items()
        }
        return LoadedVerb(
            origin, tree["ending_limit_ns"], blocks=uses, objects=objects, conditions=conditions, input_parameters=inputs,
            requires=requires, suspend=suspend, command_lists={name: given["commands"] for name, given in tree["command_lists"].items()},
            transitions={(step["from"], step["condition"]): step["to"] for step in tree["transitions"]},
            **{key: tree[key] for key in (
                "name", "doc", "manual", "instantiation_parameters", "cells", "output_values", "modes", "initial", "ending", "if_cut_off",
            )},
        )  # fmt: skip

    def _object(self, given: Tree, path: Path) -> Object | None:
        found = self._device(given["device_type"], path)
        return Object(found, given["each"]) if found is not None else None

    def _device(self, name: str, path: Path) -> type[LogicalDevice] | None:
        if name in self.trees["device_types"]:
            return self.of("device_types", name)
        found = self.devices.find(name) or _own_device_type(name)
        if found is None:
            near = did_you_mean(name, [*self.trees["device_types"], *(t.definition_name() for t in _own_device_types())])
            give = f"pass it: gpac.load(…, devices={{'{name}': …}})"
            self.refuse(UnknownName, path, f"there is no device type '{name}'", f"{near} or {give}" if near.startswith("did you") else give)
        return found

    def _termination(self, name: str, given: Tree, origin: Origin) -> Termination:
        kind = given["raises"]
        place = origin.place("conditions", name)
        if isinstance(kind, str):
            found = self.raises.find(kind)
            if found is None and self.stand_in:
                found = type(kind.rpartition(":")[2] or "Terminated", (Terminated,), {})
            if found is None:
                path = (*origin.path, "conditions", name, "raises")
                self.refuse(
                    UnknownName, path, f"there is no class '{kind}', which condition '{name}' raises", self.raises.remedy(kind, "raises")
                )
            kind = found
        elif kind:
            kind = Terminated
        returns = given["returns"]
        return Termination(
            tuple(given["on"]), None if returns is None else tuple(returns), kind or None, tuple(given["during"]), given["priority"], place,
            given["alarm"],
        )  # fmt: skip

    def _input(self, name: str, given: Tree, origin: Origin) -> InputParameter:
        form = None
        if given.get("form"):
            form = self.forms.find(given["form"])
            if form is None:
                path = (*origin.path, "input_parameters", name, "form")
                self.refuse(
                    UnknownName,
                    path,
                    f"there is no form '{given['form']}', which input '{name}' uses",
                    self.forms.remedy(given["form"], "forms"),
                )
        within = given["within"]
        return InputParameter(
            tuple(given["targets"]), absent if given["default"] is None else given["default"], given["tunable"], given["unit"],
            origin.place("input_parameters", name), None if within is None else tuple(within), given["counted_from"],
            given.get("member") or "", form,
        )  # fmt: skip

    def _device_type(self, tree: Tree, origin: Origin) -> type[LogicalDevice]:
        verb = self._named(tree["verb"], (*origin.path, "verb")) if tree["verb"] else None
        members: dict[str, Any] = {"__doc__": tree["doc"], "__module__": origin.file}
        for name, given in tree["svvs"].items():
            initial = given["initial"] or {}
            members[name] = svv(
                given["type_text"], unit=given["unit"], initial=initial.get("copy_of", initial.get("value")), history=given["history"],
                keep=bool(given.get("keep")), within=_range(given["within"]), shared=given["shared"],
            )  # fmt: skip
        for name, given in tree["parameters"].items():
            members[name] = parameter(
                given["default"], unit=given["unit"], tunable=given["tunable"], keep=given.get("keep"), within=_range(given.get("within"))
            )
        options = {"verb": verb, "name": tree["name"], "arbitration": tree["arbitration"]}
        return types.new_class(tree["name"], (LogicalDevice,), options, lambda namespace: namespace.update(members))

    def _named(self, name: str, path: Path) -> Verb[..., Any]:
        for kind in ("verbs", "compositions"):
            if name in self.trees[kind]:
                return self.of(kind, name)
        known = [*self.trees["verbs"], *self.trees["compositions"]]
        self.refuse(UnknownName, path, f"this file has no verb '{name}'", did_you_mean(name, known))
        raise _Skipped

    def _composed(self, tree: Tree, origin: Origin) -> ComposedVerb:
        parts = {label: self._named(name, (*origin.path, "parts", label)) for label, name in tree["parts"].items()}
        common: dict[str, Any] = {key: tree[key] for key in ("rename", "preset", "share", "doc")}
        if tree["together"]:
            return together(parts, name=tree["name"], until=tree["until"], **common)
        steps = {(_origins(step["from"]), step["condition"]): step["to"] for step in tree["transitions"]}
        return compose(tree["name"], parts, transitions=steps, initial=tree["initial"], **common)


def _origins(names: list[str]) -> Any:
    return names[0] if len(names) == 1 else tuple(names)


def _refusal(name: str) -> type[Error]:
    return next(kind for kind in REFUSALS if kind.__name__ == name)


def _by_name(devices: Devices) -> Mapping[str, type[LogicalDevice]]:
    return devices if isinstance(devices, Mapping) else {kind.definition_name(): kind for kind in devices or ()}


def _own_device_types() -> list[type[LogicalDevice]]:
    """Returns the device types of this package."""
    for module in ("robots", "robots.gripper", "cell"):
        importlib.import_module(f"{_PACKAGE}.{module}")
    found = [LogicalDevice]
    for kind in found:
        found += kind.__subclasses__()
    return [kind for kind in found[1:] if kind.__module__.startswith(f"{_PACKAGE}.")]


def _own_device_type(name: str) -> type[LogicalDevice] | None:
    return next((kind for kind in _own_device_types() if kind.definition_name() == name), None)


def _range(given: Any) -> Any:
    """Returns a range of a file in the format that `within=` accepts."""
    return tuple(given) if isinstance(given, list) else given
