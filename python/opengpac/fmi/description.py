# SPDX-License-Identifier: Apache-2.0
"""Description of an FMU: the parts of `modelDescription.xml` of FMI 2 and 3 that co-simulation needs."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from ..errors import ModuleError, refuse
from .archive import DESCRIPTION_BYTES_MAX, opened

ELEMENTS_MAX = 4096
"""Maximum number of elements of an array that can be a port."""

TYPES = {
    "Real": ("Real", "double"), "Integer": ("Integer", "int32_t"), "Boolean": ("Boolean", "bool"), "Enumeration": ("Integer", "int32_t"),
}  # fmt: skip
"""Type of an FMI 2 variable → the functions that get and set it, and the type of its port."""

TYPES_3 = {
    "Float64": ("Float64", "double"),
    "Float32": ("Float32", "float"),
    "Boolean": ("Boolean", "bool"),
    "Enumeration": ("Int64", "int64_t"),
} | {f"{u}Int{n}": (f"{u}Int{n}", f"{u.lower()}int{n}_t") for u in ("", "U") for n in (8, 16, 32, 64)}
"""Type of an FMI 3 variable → the functions that get and set it, and the type of its port."""


@dataclass(frozen=True)
class Variable:
    """A variable: its value `reference`, `causality`, `variability`, the functions of its `group`, the `type` of its port, its array
    `size` (0: a scalar), `start`, `unit` in FMI's notation, and its description."""

    name: str
    reference: int
    causality: str
    variability: str
    group: str
    type: str
    size: int
    start: tuple[str, ...]
    unit: str
    doc: str


@dataclass(frozen=True)
class Description:
    """A co-simulation FMU: FMI `version` 2 or 3, `identifier` of its binary, `token` (GUID), variables by name, base units by name, and
    its declared capabilities."""

    file: Path
    version: int
    name: str
    identifier: str
    token: str
    doc: str
    tool: str
    any_step: bool
    once: bool
    needs_tool: bool
    step_s: float | None
    variables: dict[str, Variable]
    units: Mapping[str, Element | None]
    binary: str
    beside: list[str] = field(default_factory=list)
    """Other files of the archive that its binary may need: resources and libraries next to it."""


def described(path: Path) -> Description:
    """Returns the description of an FMU for this machine. Raises an error with the reason if it cannot be used here."""
    if not path.is_file():
        refuse(ModuleError, f"file '{path}' does not exist", "pass the path of an FMU file (.fmu)")
    with opened(path) as archive:
        names = archive.names
        if "modelDescription.xml" not in names:
            refuse(ModuleError, f"'{path.name}' is not an FMU: it has no modelDescription.xml")
        text = archive.read("modelDescription.xml", DESCRIPTION_BYTES_MAX)
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, LookupError, ValueError) as why:
        # Encodings unknown to Python raise LookupError or ValueError.
        refuse(ModuleError, f"modelDescription.xml of '{path.name}' is damaged: {why}")
    told = root.get("fmiVersion", "none")
    if root.tag != "fmiModelDescription" or not told.startswith(("2.", "3.")):
        refuse(ModuleError, f"'{path.name}' has FMI version {told}", "export it as FMI 2 or 3, for co-simulation")
    step = root.find("CoSimulation")
    if step is None:
        kinds = [tag for tag in ("ModelExchange", "ScheduledExecution") if root.find(tag) is not None]
        refuse(
            ModuleError,
            f"'{path.name}' supports {' and '.join(kinds) or 'no interface type'}, but not co-simulation",
            "export it for co-simulation",
        )
    version = int(told[0])
    identifier = step.get("modelIdentifier", "")
    binary, beside = _binary(path, version, identifier, names)
    default = root.find("DefaultExperiment")
    size = None if default is None or default.get("stepSize") is None else _number(path, default, "stepSize", "0", float)
    return Description(
        path, version, root.get("modelName", path.stem), identifier, root.get("guid" if version == 2 else "instantiationToken", ""),
        root.get("description", ""), root.get("generationTool", ""), _true(step, "canHandleVariableCommunicationStepSize"),
        _true(step, "canBeInstantiatedOnlyOncePerProcess"),
        _true(step, "needsExecutionTool"), size,
        _variables(path, root, version), _units(root), binary, beside,
    )  # fmt: skip


_T = TypeVar("_T", int, float)


def _number(path: Path, element: Element, attribute: str, default: str, kind: Callable[[str], _T]) -> _T:
    """Parses a finite number from an attribute. The error names the element."""
    text = element.get(attribute, default)
    try:
        number = kind(text)
    except ValueError:
        number = kind("-1") if kind is int else kind("nan")
    if not math.isfinite(number) or (kind is int and number < 0):
        name = element.get("name")
        where = f"{element.tag} '{name}'" if name else element.tag
        refuse(ModuleError, f"modelDescription.xml of '{path.name}' is damaged: {attribute} of {where} is '{text}'", "export it again")
    return number


def _true(element: Element, attribute: str) -> bool:
    return element.get(attribute, "false") in ("true", "1")


def _binary(path: Path, version: int, identifier: str, names: list[str]) -> tuple[str, list[str]]:
    """Returns the binary for this machine in the archive, and the files next to it."""
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    folder = ({"x86_64": "linux64"} if version == 2 else {}).get(machine, f"{machine}-linux")
    wanted = f"binaries/{folder}/{identifier}.so"
    if wanted not in names:
        there = sorted(
            {name.split("/")[1] for name in names if name.startswith("binaries/") and name.count("/") > 1 and name.split("/")[1]}
        )
        if folder in there:
            refuse(ModuleError, f"'{path.name}' has no {identifier}.so in binaries/{folder}, contrary to its description")
        has = f"binaries for {', '.join(there)}" if there else "no binary"
        refuse(ModuleError, f"'{path.name}' has {has}, but this machine is {folder}", f"export it for {folder}")
    return wanted, [name for name in names if name.startswith(("resources/", f"binaries/{folder}/")) and name != wanted and name[-1] != "/"]


def _variables(path: Path, root: Element, version: int) -> dict[str, Variable]:
    types = {t.get("name", ""): t for t in root.iterfind("TypeDefinitions/*")}
    made: dict[str, Variable] = {}
    for element in root.iterfind("ModelVariables/*"):
        inner = next((child for child in element if child.tag in TYPES or child.tag == "String"), None) if version == 2 else element
        known = (TYPES if version == 2 else TYPES_3).get("" if inner is None else inner.tag)
        if inner is None or known is None:
            continue
        declared = types.get(inner.get("declaredType", ""))
        defined = declared if version == 3 or declared is None else next(iter(declared), None)
        unit = inner.get("unit") or ("" if defined is None else defined.get("unit", ""))
        name, size = element.get("name", ""), _size(path, element)
        reference = _number(path, element, "valueReference", "0", int)
        made[name] = Variable(
            name, reference, element.get("causality", "local"), element.get("variability", "continuous"),
            *known, size, tuple(inner.get("start", "").split()), unit, element.get("description", "") or name,
        )  # fmt: skip
    return made


def _size(path: Path, element: Element) -> int:
    """Returns the number of elements of an FMI 3 array, or 0 for a scalar."""
    lengths = [dimension.get("start") for dimension in element.iterfind("Dimension")]
    if not lengths:
        return 0
    size = 1
    for length in lengths:
        if length is None:
            text = f"variable '{element.get('name')}' of '{path.name}' is an array whose length is a parameter"
            refuse(ModuleError, text, "export it with fixed lengths")
        size *= _number(path, Element("Dimension", name=element.get("name", ""), start=length), "start", "0", int)
    if not 1 <= size <= ELEMENTS_MAX:
        text = f"variable '{element.get('name')}' of '{path.name}' has an unsupported number of elements: {size}"
        refuse(ModuleError, text, f"export it with arrays of 1 to {ELEMENTS_MAX} elements")
    return size


def _units(root: Element) -> Mapping[str, Element | None]:
    return {unit.get("name", ""): unit.find("BaseUnit") for unit in root.iterfind("UnitDefinitions/Unit")}
