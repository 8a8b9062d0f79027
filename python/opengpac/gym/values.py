# SPDX-License-Identifier: Apache-2.0
"""Values of ports as arrays, which an environment reads from its system at the end of each step, or writes to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import CallError, DefinitionError, TypeMismatch, did_you_mean, refusals, refuse
from ..system.svvs import SVV
from ..system.system import System
from ..values.encoding import plain

Variables = SVV[Any] | Sequence[SVV[Any]]


class Values(dict[str, Any]):
    """Values of the ports of an environment's task at the end of a step, by name: numbers and arrays, each in the port's unit.

    `time` is the time since the start of the episode, in s; `steps` is the number of steps.
    """

    time: float = 0.0
    steps: int = 0


class Ports:
    """Ports of a task in a fixed order. Each port is one SVV, or a list of scalar SVVs."""

    def __init__(self, system: System, ports: Mapping[str, Variables]) -> None:
        self.system = system
        self.variables: dict[str, list[SVV[Any]]] = {}
        self.units: dict[str, str] = {}
        self._names: list[str] = []
        self._places: dict[str, tuple[slice, tuple[int, ...]]] = {}
        self._types: list[np.dtype[Any]] = []
        first = 0
        for name, given in ports.items():
            several = isinstance(given, Sequence)
            variables = [*given] if isinstance(given, Sequence) else [given]
            for variable in variables:
                if not isinstance(variable, SVV):
                    refuse(
                        DefinitionError, f"port '{name}' of the task must be an SVV or a list of SVVs, not {variable!r}", "pass such SVVs"
                    )
            shape = self._shape(name, variables, several)
            size = int(np.prod(shape, dtype=int))
            self.variables[name], self.units[name] = variables, variables[0].unit
            self._names += [variable._asked for variable in variables]
            self._types += [variable.dtype for variable in variables]
            self._places[name] = (slice(first, first + size), shape)
            first += size
        self._are_doubles = all(_base(dtype) == np.dtype("<f8") for dtype in self._types)

    def _shape(self, name: str, variables: Sequence[SVV[Any]], several: bool) -> tuple[int, ...]:
        if not variables:
            refuse(DefinitionError, f"port '{name}' of the task cannot be an empty list of SVVs")
        for variable in variables:
            if _base(variable.dtype).names or (several and variable.dtype.shape):
                refuse(
                    TypeMismatch,
                    f"port '{name}' of the task cannot use SVV '{variable.name}' ({variable.type})",
                    "use SVVs of numbers, or one array",
                )
            if variable.unit != variables[0].unit:
                text = (
                    f"port '{name}' has SVVs of different units: '{variables[0].name}' ({variables[0].unit}) "
                    f"and '{variable.name}' ({variable.unit})"
                )
                refuse(DefinitionError, text, "use SVVs of one unit")
        return (len(variables),) if several else variables[0].dtype.shape

    def size(self, name: str) -> int:
        """Returns the number of elements of a port."""
        place = self._places[name][0]
        return place.stop - place.start

    def where(self, name: str, why: str) -> slice:
        """Returns the slice of a port's numbers in the result of `read`. In refusals, `why` describes the use of the port."""
        if name not in self._places:
            refuse(DefinitionError, f"{why} '{name}' is not a port of the task", did_you_mean(name, self._places))
        return self._places[name][0]

    def turn(self, stores: list[tuple[str, list[float]]], duration_ns: int) -> np.ndarray:
        """Stores numbers, advances time, and then reads all ports, one after another."""
        with refusals:
            data = self.system._alive().turn(stores, duration_ns, self._names)
        if self._are_doubles:
            return np.frombuffer(data)
        parts, first = [], 0
        for dtype in self._types:
            parts.append(np.frombuffer(data[first : first + dtype.itemsize], _base(dtype)).astype(float))
            first += dtype.itemsize
        return np.concatenate(parts)

    def stores(self, name: str) -> list[tuple[str, int]]:
        """Returns the SVVs of a port by their names in the system, each with its number of elements."""
        variables = self.variables[name]
        return [(variable._asked, self.size(name) // len(variables)) for variable in variables]

    def values(self, numbers: np.ndarray) -> Values:
        """Returns these numbers as values by name."""
        return Values(
            {name: numbers[place].reshape(shape) if shape else float(numbers[place][0]) for name, (place, shape) in self._places.items()}
        )

    def write(self, name: str, value: Any) -> None:
        """Stores a value in a port."""
        variables, native = self.variables[name], self.system._alive()
        if len(variables) == 1 and not self._places[name][1]:
            value = [value]
        elif len(variables) == 1:
            value = [np.asarray(value, dtype=float).reshape(self._places[name][1])]
        if len(value) != len(variables):
            refuse(CallError, f"port '{name}' has {len(variables)} numbers, not {len(value)}")
        with refusals:
            for variable, one in zip(variables, value, strict=True):
                native.write(variable._asked, plain(one, f"the value of port '{name}'"))


def _base(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Returns the element type of an array with any number of dimensions."""
    return dtype.base
