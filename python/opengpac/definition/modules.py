# SPDX-License-Identifier: Apache-2.0
"""Code modules: `code = cell.download("my_blocks.c")`, then `code.biquad`, `code["biquad"]`, `code.types.pose`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ..errors import DefinitionError, UnknownName, did_you_mean, refuse
from ..refusals.declared_names import DeclaredNames
from ..values.tables import Table, TableDisplay
from .blocks import Block

if TYPE_CHECKING:
    from ..system.system import System


class StructType:
    """A struct type of a code module: its `name`, its C `declaration`, and the `types` that the declaration uses. Obtained as
    `code.types.pose`."""

    def __init__(self, name: str, declaration: str, types: Mapping[str, str]) -> None:
        self.name = name
        self.declaration = declaration
        self.types = dict(types)

    def __repr__(self) -> str:
        return f"{self.name}: {self.declaration}"


class Types:
    """Struct types of a code module, as attributes."""

    def __init__(self, module: str, types: Mapping[str, str]) -> None:
        self._module = module
        self._types = types

    def __getattr__(self, name: str) -> StructType:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self._types:
            refuse(UnknownName, f"code module '{self._module}' has no type '{name}'", did_you_mean(name, self._types))
        return StructType(name, self._types[name], self._types)

    __getitem__ = __getattr__

    def _ipython_key_completions_(self) -> list[str]:
        return [*self._types]

    def __dir__(self) -> list[str]:
        return [*self._types]


class Module(TableDisplay, DeclaredNames):
    """Blocks and types of a downloaded code module: `code.lowpass`, `code["lowpass"]`, `code.types.pose`. Returned by `cell.download`."""

    def __init__(self, described: Mapping[str, Any], path: str, system: System) -> None:
        self._name: str = described["name"]
        self._path = path
        self._blocks = {b["name"].split(".", 1)[1]: Block(b, described.get("path", path), system) for b in described["blocks"]}
        self.types = Types(self._name, described.get("types", {}))

    def __getattr__(self, name: str) -> Block:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __getitem__(self, name: str) -> Block:
        if name not in self._blocks:
            refuse(UnknownName, f"code module '{self._name}' has no block '{name}'", did_you_mean(name, self._blocks))
        return self._blocks[name]

    def __iter__(self) -> Iterator[Block]:
        return iter(self._blocks.values())

    def __len__(self) -> int:
        return len(self._blocks)

    def __dir__(self) -> list[str]:
        return [*self._blocks, "types"]

    def _ipython_key_completions_(self) -> list[str]:
        return [*self._blocks]

    def _called(self) -> str:
        return f"code module '{self._name}'"

    def _table(self) -> Table:
        rows = [(name, block.doc.partition("\n")[0]) for name, block in self._blocks.items()]
        return Table(f"code module '{self._name}'", ["block", "description"], rows)

    def __repr__(self) -> str:
        return f"code module '{self._name}' ({self._path}): {', '.join(self._blocks)}"


PYTHON_TYPES = {float: "double", int: "int64_t", bool: "bool", "float": "double", "int": "int64_t", "bool": "bool"}
"""C types by Python type and by type name."""


def type_json(given: Any, what: str) -> tuple[str, dict[str, str]]:
    """Returns a C type and the struct types on which it depends, from a declaration, a type of a code module, or `float`, `int`, `bool`."""
    if isinstance(given, StructType):
        return given.name, given.types
    if isinstance(given, str):
        return given, {}
    if isinstance(given, type) and given in PYTHON_TYPES:
        return PYTHON_TYPES[given], {}
    refuse(
        DefinitionError,
        f"the type of {what} must be a C type, not {given!r}",
        "pass a C declaration, 'double[6]', a type of a code module, or float, int, bool",
    )
