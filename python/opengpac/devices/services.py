# SPDX-License-Identifier: Apache-2.0
"""Services of drivers: acyclic commands, as methods of `device.services`."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from .. import _native
from ..errors import CallError, UnknownName, did_you_mean, refusals, refuse
from ..values.encoding import lively, plain
from ..values.quantities import duration_ns
from ..values.tables import Table, TableDisplay

if TYPE_CHECKING:
    from .physical import PhysicalDevice

_TYPES: Mapping[str, Any] = {"text": str, "number": float, "whole": int, "bool": bool, "list": list, "table": dict}


class Service:
    """A service of a physical device. Calling it makes the driver execute the service, and returns the driver's answer."""

    def __init__(self, device: PhysicalDevice, about: Mapping[str, Any]) -> None:
        self.device = device
        # Required arguments come first, regardless of the order of the driver's declaration.
        self.about = {**about, "arguments": sorted(about["arguments"], key=lambda argument: argument["default"] is not None)}
        self.name: str = about["name"]
        self.__name__ = self.name
        self.__doc__ = _documented(self.about)
        self.__signature__ = inspect.Signature(
            [_parameter(argument) for argument in self.about["arguments"]],
            return_annotation=_TYPES.get(about["answer"]),
        )

    def __call__(self, *values: Any, **named: Any) -> Any:
        declared = {argument["name"]: argument for argument in self.about["arguments"]}
        if len(values) > len(declared):
            refuse(CallError, f"{self._called()} takes {len(declared)} arguments, not {len(values)}", f"call it as {self}")
        given = dict(zip(declared, values, strict=False))
        for twice in given.keys() & named.keys():
            refuse(CallError, f"{self._called()} has two values for '{twice}'", f"call it as {self}")
        given |= named
        arguments = {name: self._value(name, value, declared.get(name)) for name, value in given.items() if value is not None}
        native = self.device._here()
        with refusals:
            return lively(native.device_service(self.device.name, self.name, arguments))

    def _value(self, name: str, value: Any, declared: Mapping[str, Any] | None) -> Any:
        what = f"'{name}' of {self._called()}"
        unit = declared["unit"] if declared else ""
        if isinstance(value, str) and unit in ("ns", "s"):
            ns = duration_ns(value, what)
            return ns if unit == "ns" else ns * 1e-9
        if isinstance(value, str) and unit and declared and declared["kind"] in ("number", "whole"):
            # Values that are not quantities are refused later, according to the declaration.
            with contextlib.suppress(_native.Refused):
                number = _native.number_in(value, unit)
                return round(number) if declared["kind"] == "whole" else number
        return plain(value, what)

    def _called(self) -> str:
        return f"service '{self.name}' of physical device '{self.device.name}'"

    def __repr__(self) -> str:
        return f"{self.name}{self.__signature__}"


def _parameter(argument: Mapping[str, Any]) -> inspect.Parameter:
    default = inspect.Parameter.empty if argument["default"] is None else None
    kind = _TYPES[argument["kind"]]
    annotation = kind if argument["default"] is None else kind | None
    return inspect.Parameter(argument["name"], inspect.Parameter.POSITIONAL_OR_KEYWORD, default=default, annotation=annotation)


def _documented(about: Mapping[str, Any]) -> str:
    moves = " It moves the machine and is refused while an emergency stop is latched." if about["moves"] else ""
    lines = [f"{about['doc'][:1].upper()}{about['doc'][1:]}.{moves}"]
    for argument in about["arguments"]:
        unit = f", {argument['unit']}" if argument["unit"] else ""
        left_out = "" if argument["default"] is None else f"; default: {argument['default']}"
        lines.append(f"{argument['name']}: {argument['doc']}{unit}{left_out}.")
    return "\n\n".join([lines[0], "\n".join(lines[1:])]).strip()


class Services(TableDisplay):
    """Acyclic services of a physical device's driver: `device.services.home(joint="elbow")`."""

    def __init__(self, device: PhysicalDevice) -> None:
        self._device = device
        self._services = {about["name"]: Service(device, about) for about in device.about.get("services") or []}

    def __getattr__(self, name: str) -> Service:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __getitem__(self, name: str) -> Service:
        if name not in self._services:
            none = "use a device whose driver declares services"
            meant = did_you_mean(name, self._services) if self._services else none
            refuse(UnknownName, f"physical device '{self._device.name}' has no service '{name}'", meant)
        return self._services[name]

    def __iter__(self) -> Iterator[Service]:
        return iter(self._services.values())

    def __len__(self) -> int:
        return len(self._services)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._services]

    def _ipython_key_completions_(self) -> list[str]:
        return [*self._services]

    def _table(self) -> Table:
        rows = [(f"{service!r}", service.about["doc"]) for service in self]
        return Table(f"services of {self._device.name}", ["service", "description"], rows)

    def __str__(self) -> str:
        return repr(self._table()) if self else repr(self)

    def __repr__(self) -> str:
        return f"services of {self._device.name}: {', '.join(self._services) or 'none'}"
