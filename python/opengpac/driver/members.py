# SPDX-License-Identifier: Apache-2.0
"""Members that a driver class declares: options, channels, parts, counters and services, with their values and their text for manuals."""

from __future__ import annotations

import inspect
import math
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from .. import _native
from ..errors import CallError, DefinitionError, did_you_mean, refusals, refuse
from ..values.numbers import number, range_of

_FORMATS = {
    "bool": "?", "int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i", "uint32_t": "I", "int64_t": "q",
    "uint64_t": "Q", "float": "f", "double": "d",
}  # fmt: skip
NEEDED: Any = object()


class NothingNew:
    """Type of `NOTHING_NEW`."""

    def __repr__(self) -> str:
        return "NOTHING_NEW"


NOTHING_NEW: Final = NothingNew()
"""Return value of `exchange` if the machine has reported nothing since the previous exchange; the previous readings remain."""

_KINDS: dict[str, type] = {"str": str, "int": int, "float": float, "bool": bool, "list": list, "dict": dict}
_KIND_NAMES: dict[type | None, str] = {str: "text", int: "whole", float: "number", bool: "bool", list: "list", dict: "table"}
"""Names of option types in driver declarations."""


class NamedMember:
    """Member that a class declares, named after its attribute."""

    name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name


class OptionMember(NamedMember):
    def __init__(self, doc: str, default: Any, unit: str, within: str | Sequence[float] | None = None) -> None:
        self.doc, self.default, self.unit = doc, default, unit
        ends = range_of(within, "the range of an option")
        text = ends if isinstance(ends, str | None) else f"[{ends[0]}, {ends[1]}]"
        # A time without a declared range is not negative.
        self.range = text or ("[0, inf)" if unit in ("s", "ns") else None)

    def taken(self, kind: type | None, value: Any, what: str) -> Any:
        """Returns the value of the option, converted to its annotated type; text with a unit is converted to a number in the option's
        unit."""
        if isinstance(value, str) and kind in (int, float) and self.unit:
            with refusals:
                value = kind(_native.number_in(value, self.unit))
        value = number(value)
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            return float(value)
        if kind is not None and (not isinstance(value, kind) or (kind is int and isinstance(value, bool))):
            unit = f" in {self.unit}" if self.unit else ""
            refuse(CallError, f"{what} must be of type {kind.__name__}{unit}, not {value!r}", f"pass such a value: {self.doc}")
        if kind in (int, float):
            with refusals:
                _native.check_range(what, f"{self.unit} {self.range or ''}".strip(), float(value))
        return value

    def about(self, name: str, kind: type | None) -> dict[str, Any]:
        """Returns the option's entry in manuals."""
        default = None if self.default is NEEDED else str(self.default)
        ranged = {} if self.range is None or kind not in (int, float) else {"range": self.range}
        return {"name": name, "kind": _KIND_NAMES.get(kind, "text"), "unit": self.unit, **ranged, "default": default, "doc": self.doc}


def annotated(owner: type, name: str) -> type | None:
    for kind in owner.__mro__:
        given = inspect.get_annotations(kind).get(name)
        if given is not None:
            return kind_of(given)
    return None


def kind_of(given: Any) -> type | None:
    return given if isinstance(given, type) else _KINDS.get(str(given).partition("[")[0])


class Channel(NamedMember):
    """A channel of a driver. Created by `read` and `write`. As an attribute of the driver object it is the value."""

    def __init__(self, type: str, unit: str, doc: str, write: bool, safe: Any, slew: float | None) -> None:
        number, _, count = type.partition("[")
        if number not in _FORMATS or (count and not count[:-1].isdecimal()):
            refuse(DefinitionError, f"a channel cannot have type '{type}'", did_you_mean(number, _FORMATS))
        self.type, self.unit, self.doc, self.write, self.slew = type, unit, doc, write, slew
        self.elements = int(count[:-1]) if count else None
        self.format = struct.Struct(f"={self.elements or 1}{_FORMATS[number]}")
        zero: Any = False if number == "bool" else 0.0 if number in ("float", "double") else 0
        self.initial = (zero if self.elements is None else [zero] * self.elements) if safe is None else safe

    def pack(self, value: Any) -> bytes:
        """Returns the bytes of a value. Refuses values that the type cannot represent."""
        try:
            return self.format.pack(*(value if self.elements is not None else (value,)))
        except (struct.error, TypeError) as why:
            raise TypeError(f"channel '{self.name}' ({self.type}) cannot hold {value!r}: {why}") from None

    def unpack(self, group: bytes, offset: int) -> Any:
        """Unpacks the value at `offset` of the group."""
        values = self.format.unpack_from(group, offset)
        return values[0] if self.elements is None else list(values)


class Part(NamedMember):
    """A joint of the machine. Created by `part`. As an attribute of the driver object it is the joint's `PartValues`."""

    def __init__(self, unit: str, command: str, operating: bool, limits: Mapping[str, Any]) -> None:
        self.unit, self.command, self.limits = unit, command, limits
        force = "N.m" if unit == "rad" else "N"
        self.channels = {
            "position": Channel("double", unit, "position", False, None, None),
            "velocity": Channel("double", f"{unit}/s", "velocity", False, None, None),
        }
        if command == "position":
            self.channels["goal"] = Channel("double", unit, "commanded position; NaN: hold the present one", True, math.nan, None)
        else:
            self.channels["bias"] = Channel("double", force, "effort that holds it", False, None, None)
            self.channels["effort"] = Channel("double", force, "commanded effort", True, None, None)
        if operating:
            self.channels["operating"] = Channel("bool", "", "true while it follows commands", False, None, None)

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        for word, channel in self.channels.items():
            channel.name = f"{name}.{word}"

    def about(self) -> dict[str, Any]:
        """Returns the declaration of the part for devices."""
        return {"name": self.name, "unit": self.unit, "command": self.command, **self.limits}


class PartValues:
    """Values of a joint: `position`, `velocity`, and `goal` or `bias` and `effort`, as declared by its `part`.

    `engaged` is True if a verb commands the joint; the motor of a disengaged joint must be off, or hold its position.
    """

    def __init__(self, part: Part) -> None:
        self.__dict__["engaged"] = False
        self.__dict__.update({word: channel.initial for word, channel in part.channels.items()})

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self.__dict__:
            raise AttributeError(f"a part has no channel '{name}'; {did_you_mean(name, self.__dict__)}")
        self.__dict__[name] = value

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"a part has no channel '{name}'; {did_you_mean(name, self.__dict__)}")


class Counter(NamedMember):
    """Counter of a driver. Created by `counter`. As an attribute of the driver object it is the current count."""

    def __init__(self, doc: str, unit: str) -> None:
        self.doc, self.unit = doc, unit

    def about(self) -> dict[str, Any]:
        """Returns the counter's entry in manuals."""
        return {"name": self.name, "unit": self.unit, "doc": self.doc}


class Service:
    """A service of a driver. Created by `service` from a method. Its arguments are those of the method, as `Option`s or with plain
    defaults."""

    def __init__(self, method: Callable[..., Any], moves: bool) -> None:
        self.name = method.__name__
        self.moves = moves
        self.doc = (inspect.getdoc(method) or "").partition("\n")[0].rstrip(".")
        signature = inspect.signature(method)
        self.arguments = {name: (_argument(name, p), kind_of(p.annotation)) for name, p in [*signature.parameters.items()][1:]}
        for name, (_, kind) in self.arguments.items():
            if kind not in _KIND_NAMES:
                kinds = ", ".join(_KINDS)
                refuse(
                    DefinitionError,
                    f"argument '{name}' of service '{self.name}' has a type that cannot be sent",
                    f"annotate it as one of {kinds}",
                )
        given = signature.return_annotation
        self.answer = None if given in (None, "None", inspect.Signature.empty) else kind_of(given)
        if self.answer not in _KIND_NAMES and self.answer is not None:
            refuse(
                DefinitionError,
                f"service '{self.name}' returns {given}, which cannot be sent",
                f"return None or one of {', '.join(_KINDS)}",
            )
        if not self.doc:
            refuse(DefinitionError, f"service '{self.name}' has no docstring", "describe in one line what it does")

    def taken(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the arguments for the method. Refuses missing or unknown arguments and arguments of the wrong type."""
        for wrong in given.keys() - self.arguments.keys():
            refuse(CallError, f"service '{self.name}' has no argument '{wrong}'", did_you_mean(wrong, self.arguments))
        found: dict[str, Any] = {}
        for name, (option, kind) in self.arguments.items():
            if name not in given and option.default is NEEDED:
                refuse(CallError, f"service '{self.name}' needs argument '{name}'", f"pass {name}: {option.doc}")
            what = f"argument '{name}' of service '{self.name}'"
            found[name] = option.taken(kind, given[name], what) if name in given else option.default
        return found

    def about(self) -> dict[str, Any]:
        """Returns the service's entry in manuals."""
        arguments = [option.about(name, kind) for name, (option, kind) in self.arguments.items()]
        answer = _KIND_NAMES[self.answer] if self.answer else None
        return {"name": self.name, "doc": self.doc, "arguments": arguments, "answer": answer, "moves": self.moves}


def _argument(name: str, parameter: inspect.Parameter) -> OptionMember:
    if isinstance(parameter.default, OptionMember):
        return parameter.default
    return OptionMember(name, NEEDED if parameter.default is inspect.Parameter.empty else parameter.default, "")
