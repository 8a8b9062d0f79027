# SPDX-License-Identifier: Apache-2.0
"""Contents of a definition file, by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path as File
from typing import Any

from ...errors import UnknownName, did_you_mean
from ...refusals.source_location import Place
from .trees import Definition, Tree


class DefinitionFile(Mapping[str, Any]):
    """Contents of a definition file: `shapes["smooth"]` or `shapes.smooth` is a graph, a verb that can be called, or a device type.

    Returned by `gpac.load`. Raises `UnknownName` for a name that the file does not define. `description` is the file's description,
    `path` its location, and `modules` its code modules: name → file.
    """

    def __init__(self, path: File, tree: Tree) -> None:
        self.path = path
        self.description: str = tree.get("description", "")
        self.modules: dict[str, str] = dict(tree.get("modules", {}))
        self._made: dict[str, Definition] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._made:
            raise UnknownName(
                f"file '{self.path}' does not define '{name}'", remedy=did_you_mean(name, self._made), place=Place(str(self.path), 1)
            )
        return self._made[name]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._made)

    def __len__(self) -> int:
        return len(self._made)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._made]

    def __repr__(self) -> str:
        return f"definitions of '{self.path}': {', '.join(self._made)}"
