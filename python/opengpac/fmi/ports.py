# SPDX-License-Identifier: Apache-2.0
"""Ports and parameters of an FMU's block: its variables, with their names and units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from .. import _native
from ..errors import DefinitionError, ModuleError, UnitMismatch, did_you_mean, refuse
from ..python.items import WIDTHS, Item
from ..python.words import Input, Output, Parameter
from ..values.quantities import unknown_unit
from .code import Port, Ports
from .description import Description, Variable

ITEMS_MAX = 30
"""Maximum number of items of a block, excluding its own two states."""


def ports_of(
    fmu: Description,
    block: str,
    inputs: Sequence[str] | Mapping[str, str] | None,
    outputs: Sequence[str] | Mapping[str, str] | None,
    parameters: Sequence[str] | Mapping[str, str] | None,
    units: Mapping[str, str],
    device: bool = False,
) -> Ports:
    """Returns the ports of an FMU's block; refuses unsuitable names and units."""
    for name in units:
        if name not in fmu.variables:
            refuse(
                DefinitionError,
                f"units= of '{block}' names '{name}', which '{fmu.file.name}' does not have",
                did_you_mean(name, fmu.variables),
            )
    sides = {
        "input": _chosen(fmu, block, "input", inputs),
        "output": _chosen(fmu, block, "output", outputs),
        "parameter": _chosen(fmu, block, "parameter", parameters),
    }
    made = {side: [_port(fmu, block, side, variable, name, units) for variable, name in chosen] for side, chosen in sides.items()}
    names = [port.item.name for ports in made.values() for port in ports]
    for name in names:
        if names.count(name) > 1:
            both = [p.variable.name for ports in made.values() for p in ports if p.item.name == name]
            refuse(
                DefinitionError,
                f"'{both[0]}' and '{both[1]}' of '{fmu.file.name}' would both be named '{name}'",
                f"rename one: {{'{both[1]}': '…'}}",
            )
    if len(names) > ITEMS_MAX and not device:
        text = f"'{fmu.file.name}' has {len(names)} inputs, outputs and parameters, but a block has at most {ITEMS_MAX}"
        refuse(DefinitionError, text, "select some of them: gpac.fmu(…, inputs=[…], outputs=[…], parameters=[…])")
    if not made["output"]:
        refuse(DefinitionError, f"'{fmu.file.name}' has no output that can be a port", "choose one: gpac.fmu(…, outputs=[…])")
    tunable = [port for port in made["parameter"] if port.variable.variability == "tunable"]
    return Ports(made["input"], made["output"], [port for port in made["parameter"] if port not in tunable], tunable)


def _chosen(fmu: Description, block: str, side: str, given: Sequence[str] | Mapping[str, str] | None) -> list[tuple[Variable, str]]:
    """Returns the variables of one side, and the names of their items."""
    there = {v.name: v for v in fmu.variables.values() if v.causality == side and v.variability != "constant"}
    if given is None:
        return [(variable, _c_name(name)) for name, variable in there.items() if name != "time"]
    if side == "output":
        there |= {v.name: v for v in fmu.variables.values() if v.causality == "local"}
    named = given if isinstance(given, Mapping) else {name: _c_name(name) for name in given}
    for name in named:
        if name not in there:
            other = fmu.variables.get(name)
            what = f"is {'an' if other.causality[0] in 'aeiou' else 'a'} {other.causality}" if other else "is not a number"
            refuse(DefinitionError, f"{side} '{name}' of '{block}' {what} in '{fmu.file.name}'", did_you_mean(name, there))
    return [(there[name], item) for name, item in named.items()]


def _is_taken(name: str) -> bool:
    """Returns whether a name is a C keyword, or the name of a state of the FMU's block."""
    return _native.is_word_of_c(name) or name in ("lease", "begun")


def _c_name(name: str) -> str:
    made = "".join(c if c.isalnum() and c.isascii() else "_" for c in name).strip("_") or "value"
    return f"{made}_value" if _is_taken(made) or made[0].isdigit() else made


def _port(fmu: Description, block: str, side: str, variable: Variable, name: str, units: Mapping[str, str]) -> Port:
    if not name.isidentifier() or not name.isascii() or _is_taken(name):
        refuse(DefinitionError, f"'{variable.name}' of '{block}' cannot be named '{name}'", "choose another name")
    unit = _unit(fmu, block, variable, units)
    shape = (variable.size,) if variable.size else ()
    word: Any = {"input": Input, "output": Output, "parameter": Parameter}[side](variable.doc, unit)
    start = _start(fmu, variable) if side == "parameter" else None
    return Port(variable, Item(name, word, variable.type, shape, start, 0))


def _unit(fmu: Description, block: str, variable: Variable, units: Mapping[str, str]) -> str:
    """Returns the unit in this package's notation."""
    unit = units.get(variable.name, variable.unit)
    if unit in ("", "1", "-"):
        return ""
    if unknown_unit(unit) is None:
        return unit
    spelled = "" if variable.name in units else _spelled(fmu.units.get(unit))
    if spelled and unknown_unit(spelled) is None:
        return spelled
    text = f"variable '{variable.name}' of '{fmu.file.name}' has the unknown unit '{unit}'"
    refuse(UnitMismatch, text, f"{unknown_unit(unit)}; write it differently, units={{'{variable.name}': 'rad/s'}}, or write '' for no unit")


def _spelled(base: Element | None) -> str:
    """Returns a unit written in terms of SI base units from its exponents; an empty text if it has a factor or an offset."""
    try:
        if base is None or float(base.get("factor", "1")) != 1.0 or float(base.get("offset", "0")) != 0.0:
            return ""
        powers = {symbol: int(base.get(symbol, "0")) for symbol in ("kg", "m", "s", "A", "K", "mol", "cd", "rad")}
    except ValueError:
        # A malformed unit counts as unknown.
        return ""
    over = [symbol if n == 1 else f"{symbol}^{n}" for symbol, n in powers.items() if n > 0]
    under = [symbol if n == -1 else f"{symbol}^{-n}" for symbol, n in powers.items() if n < 0]
    return "/".join([".".join(over) or "1", *under]) if over or under else ""


def start_of(port: Port, fmu: Description) -> Any:
    """Returns the start value of a variable, 0 by default: a number or Boolean, or a list of them for an array."""
    values = _starts(fmu, port.variable)
    return values if port.variable.size else values[0]


def _starts(fmu: Description, variable: Variable) -> list[Any]:
    texts = list(variable.start or ("0",))
    count = max(1, variable.size)
    if len(texts) == 1:
        texts *= count
    wrong = len(texts) != count
    values: list[Any] = []
    for text in texts:
        try:
            values.append(_value(variable.type, text))
        except (ValueError, OverflowError):
            wrong = True
    if wrong:
        text = f"the start value of variable '{variable.name}' of '{fmu.file.name}' is not valid: '{' '.join(variable.start)[:60]}'"
        refuse(ModuleError, text, f"export it with {count} of {variable.type}")
    return values


def _value(kind: str, text: str) -> bool | int | float:
    """Parses a text as the type of a port. Raises `ValueError` if the text is not of that type."""
    if kind == "bool":
        if text not in ("true", "false", "0", "1"):
            raise ValueError(text)
        return text in ("true", "1")
    if kind in ("double", "float"):
        number = float(text)
        if not math.isfinite(number):
            raise ValueError(text)
        return number
    number = np.dtype(WIDTHS[kind]).type(int(text))
    return int(number)


def _start(fmu: Description, variable: Variable) -> str:
    """Returns the default of a parameter as C code."""
    values = _starts(fmu, variable)
    texts = [str(v).lower() if isinstance(v, bool) else repr(v) for v in values]
    return texts[0] if len(texts) == 1 else f"({', '.join(texts)})"
