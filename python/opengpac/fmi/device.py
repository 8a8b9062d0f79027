# SPDX-License-Identifier: Apache-2.0
"""Implements `gpac.drivers.fmu`: an FMU as a physical device, in a separate process. A driver in Python is generated for it, and cached."""

from __future__ import annotations

import hashlib
import keyword
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..drivers.driver import Driver
from ..drivers.in_python import python
from ..errors import CallError, ModuleError, refuse
from ..refusals.argument_types import taking
from ..storage.cache import folder, keep
from ..values.quantities import Quantity, duration_ns
from .block import Chosen, unpacked
from .code import Port, Ports
from .description import Description, described
from .ports import ports_of, start_of


@taking
def fmu(
    path: str | os.PathLike[str],
    *,
    step: Quantity,
    inputs: Chosen | None = None,
    outputs: Chosen | None = None,
    parameters: Mapping[str, Any] | None = None,
    units: Mapping[str, str] | None = None,
    age_max: Quantity | None = None,
) -> Driver:
    """An FMU as a physical device: a plant, or an FMU with an embedded interpreter. Inputs are written channels, outputs are read
    channels.

    It runs in a separate process and takes one `step` in each period of that length, with the current inputs; a source that exchanges
    with it never waits for it. Under the virtual clock it takes one step at each firing of its source, whose period must be `step`.
    `parameters` are values by FMI's names; `path`, `inputs`, `outputs` and `units` are as in `gpac.fmu`, `age_max` is as in
    `gpac.drivers.python`.
    """
    fmu = described(Path(path).expanduser().absolute())
    step_ns = duration_ns(step, "the step")
    own_ns = None if fmu.step_s is None else round(fmu.step_s * 1e9)
    if step_ns <= 0 or (not fmu.any_step and own_ns not in (None, step_ns)):
        text = f"'{fmu.file.name}' supports only steps of {(own_ns or 0) / 1e6:g} ms (no canHandleVariableCommunicationStepSize)"
        refuse(
            ModuleError,
            text if step_ns > 0 else f"the step of '{fmu.file.name}' must be above 0 s, not {step!r}",
            "pass that time as step=" if step_ns > 0 else "pass step='10 ms', for example",
        )
    ports = ports_of(fmu, fmu.name, inputs, outputs, list(parameters or {}), units or {}, device=True)
    library, resources = unpacked(fmu)
    constants = [_constant(fmu, port, (parameters or {})[port.variable.name]) for port in (*ports.fixed, *ports.tunable)]
    text = _source(fmu, ports, constants, str(library), resources, step_ns)
    file = folder("fmu-devices") / f"fmu_{hashlib.sha256(text.encode()).hexdigest()[:24]}.py"
    if not file.exists():
        keep(file, text.encode())
    return python(file, period=step_ns * 1e-9, age_max=age_max)


def _constant(fmu: Description, port: Port, value: Any) -> str:
    number = value if not port.variable.size else list(value)
    parts = number if isinstance(number, list) else [number]
    if not all(isinstance(part, bool | int | float) for part in parts) or len(parts) != port.count:
        refuse(
            CallError,
            f"parameter '{port.variable.name}' of '{fmu.file.name}' must be {port.count} numbers, not {value!r}",
            "pass numbers in its unit",
        )
    return f"({_whole(port)}, {number!r})"


def _whole(port: Port) -> str:
    return f"Whole({port.variable.reference}, {port.variable.group!r}, {port.variable.size})"


def _source(fmu: Description, ports: Ports, constants: list[str], library: str, resources: str, step_ns: int) -> str:
    """Returns the text of the generated driver in Python."""

    def channel(port: Port, word: str) -> str:
        safe = f", safe={start_of(port, fmu)!r}" if word == "write" else ""
        unit = getattr(port.item.word, "unit", "")
        more = f", unit={unit!r}" if unit else ""
        return f"    {_name(port)} = {word}({port.item.type!r}{more}{safe}, doc={port.variable.doc!r})"

    lines = [
        "from opengpac.driver import Driver, read, write",
        "from opengpac.fmi.stepping import FmuInstance, Whole",
        "",
        "",
        "class Fmu(Driver):",
        f"    {(fmu.doc or fmu.name)!r}",
        "",
        *(channel(port, "read") for port in ports.outputs),
        *(channel(port, "write") for port in ports.inputs),
        "",
        "    def open(self):",
        f"        self._unit = FmuInstance({fmu.version}, {library!r}, {fmu.name!r}, {fmu.token!r}, {resources!r})",
        "        self._steps = 0",
        f"        self._unit.initialised([{', '.join(constants)}])",
        "        self._take()",
        "",
        "    def _take(self):",
        *(f"        self.{_name(port)} = self._unit.get({_whole(port)})" for port in ports.outputs),
        "",
        "    def exchange(self):",
        *(f"        self._unit.set({_whole(port)}, self.{_name(port)})" for port in ports.inputs),
        f"        self._unit.step(self._steps * {step_ns} * 1e-9, {step_ns} * 1e-9)",
        "        self._steps += 1",
        "        self._take()",
        "",
        "    def safe_state(self):",
        "        pass",
        "",
        "    def close(self):",
        "        unit, self._unit = getattr(self, '_unit', None), None",
        "        if unit is not None:",
        "            unit.close()",
    ]
    return "\n".join(lines) + "\n"


def _name(port: Port) -> str:
    return f"{port.item.name}_value" if keyword.iskeyword(port.item.name) else port.item.name
