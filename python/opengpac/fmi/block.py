# SPDX-License-Identifier: Apache-2.0
"""Implements `gpac.fmu`: creates a function block from a co-simulation FMU. Its C code is compiled once per content, and cached for
later processes."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from ..definition.blocks import Block
from ..definition.generated_code import block_name, interface, kept
from ..errors import DefinitionError, ModuleError, UnitMismatch, refuse
from ..refusals.argument_types import taking
from ..storage.cache import folder, keep
from ..values.numbers import number
from ..values.quantities import Quantity, optional_ns
from . import code
from .archive import opened
from .description import Description, described
from .interpreters import check_native
from .ports import ports_of, start_of

KIND = "fmu-blocks"

Chosen: TypeAlias = "Sequence[str] | Mapping[str, str]"

PROBLEMS = {
    3: "all its instances are in use by blocks that ran more recently; pass a larger instances=",
    7: "it rejects an input value",
    8: "it rejects these values at initialisation",
    10: "its binary cannot be loaded: a library that it needs is missing",
    11: "its binary lacks a function that FMI requires",
    12: "it rejects instantiation",
}
"""Texts of the faults that a block's first invocation can report."""


class FmuBlock(Block):
    """Block of an FMU. Created by `gpac.fmu`. `file` is the FMU, `description` its own description, `period_ns` the only step size that
    it supports, or None."""

    def __init__(self, interface: Mapping[str, Any], module: str, description: Description, period_ns: int | None) -> None:
        super().__init__(interface, module)
        self.file = description.file
        self.description = description
        self.period_ns = period_ns


@taking
def fmu(
    path: str | os.PathLike[str],
    inputs: Chosen | None = None,
    outputs: Chosen | None = None,
    parameters: Chosen | None = None,
    *,
    units: Mapping[str, str] | None = None,
    every: Quantity | None = None,
    instances: int = 4,
    name: str | None = None,
    doc: str = "",
) -> FmuBlock:
    """Creates a function block from a co-simulation FMU (FMI 2 or 3). The first invocation of a start initialises the FMU; each later
    one steps it from the time of the previous invocation to its own, with the current inputs.

    Numbers, Booleans and arrays become items of the block with their units; characters that are invalid in C become '_'. `inputs`,
    `outputs` and `parameters` select variables, or `{"body.v": "speed"}` also renames them; by default all are included. Parameters
    that are not tunable take effect at the next start. `units` defines units that the FMU lacks or names differently. `every` is the
    only interval at which it can run, if it supports a single step size without declaring it. `instances` is the number of FMU
    instances that are created when the block is loaded; it limits concurrent uses in each process. `path` is the FMU's file, `name`
    the block's name, by default the FMU's, and `doc` its description.

    Raises `ModuleError` with the reason for a file that cannot be used: FMI version, platform, no binary, a required tool, an
    embedded interpreter; `UnitMismatch` for an unknown unit; `DefinitionError` for unsuitable names.
    """
    fmu = described(Path(path).expanduser().absolute())
    given = name or "".join(c if c.isalnum() and c.isascii() else "_" for c in fmu.name)
    given = block_name(f"fmu_{given}" if not given or given[0].isdigit() else given)
    instances = number(instances)
    if isinstance(instances, bool) or not isinstance(instances, int) or not 1 <= instances <= 1024:
        refuse(
            DefinitionError,
            f"instances= of '{given}' must be an integer from 1 to 1024, not {instances!r}",
            "pass the maximum number of blocks that use the FMU at the same time",
        )
    check_native(fmu)
    period_ns = _period(fmu, given, optional_ns(every, f"the interval of '{given}'"))
    ports = ports_of(fmu, given, inputs, outputs, parameters, units or {})
    library, resources = unpacked(fmu)
    text = code.source(
        given, doc or fmu.doc or f"{fmu.name}, an FMU.", fmu, ports, library, not fmu.beside, resources, period_ns or 0,
        1 if fmu.once else instances,
    )  # fmt: skip
    key = [text, hashlib.sha256(library.read_bytes()).hexdigest()]
    found = kept(KIND, given, key, lambda: text)
    made = FmuBlock(_interface(given, found), str(found), fmu, period_ns)
    _try(made, fmu, ports)
    return made


def _period(fmu: Description, name: str, every_ns: int | None) -> int | None:
    """Returns the only interval at which an FMU can run, or None if any is possible."""
    own = None if fmu.step_s is None else round(fmu.step_s * 1e9)
    if fmu.any_step:
        return every_ns
    if every_ns is None and own is None:
        text = f"'{fmu.file.name}' supports only one step size (no canHandleVariableCommunicationStepSize) but does not specify this size"
        refuse(ModuleError, text, f"specify the step: gpac.fmu(…, every='10 ms') for '{name}'")
    return every_ns or own


def unpacked(fmu: Description) -> tuple[Path, str]:
    """Returns the path of the FMU's binary, and the location of its resources in FMI's format. Unpacks an archive once per content."""
    digest = hashlib.sha256(fmu.file.read_bytes()).hexdigest()[:24]
    root = folder("fmus") / digest
    with opened(fmu.file) as archive:
        archive.check_size([fmu.binary, *fmu.beside])
        for entry in [fmu.binary, *fmu.beside]:
            target = root / entry
            if not target.resolve().is_relative_to(root.resolve()):
                refuse(ModuleError, f"'{fmu.file.name}' has an entry with a path outside the archive, '{entry}'")
            if not target.exists():
                keep(target, archive.read(entry))
    if not any(entry.startswith("resources/") for entry in fmu.beside):
        return root / fmu.binary, ""
    resources = root / "resources"
    return root / fmu.binary, f"{resources}/" if fmu.version == 3 else resources.as_uri()


def _interface(name: str, found: Path) -> Mapping[str, Any]:
    try:
        return interface(f"fmu:{name}", found)
    except (ModuleError, UnitMismatch, DefinitionError) as why:
        raise type(why)(f"block '{name}': {why.message}", remedy=why.remedy, place=why.place) from None


def _try(block: FmuBlock, fmu: Description, ports: code.Ports) -> None:
    """Test-runs the first invocation, which loads the FMU and initialises it with the start values of its inputs."""
    values: dict[str, Any] = {port.item.name: [start_of(port, fmu)] for port in ports.inputs}
    fault = block.run(steps=1, **values).fault
    if fault is not None:
        number = fault["text"].rpartition(" ")[2]
        why = PROBLEMS.get(int(number), fault["text"]) if number.isdigit() else fault["text"]
        refuse(ModuleError, f"'{fmu.file.name}' cannot be run: {why}")


__all__ = ["FmuBlock", "fmu"]
