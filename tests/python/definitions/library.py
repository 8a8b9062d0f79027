# SPDX-License-Identifier: Apache-2.0
"""Every graph and verb that the library, the examples and the graphs of the mappings have."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import opengpac as gpac
from opengpac import library

EXAMPLES = Path(__file__).parents[3] / "examples"


def packaged() -> Iterator[Any]:
    """Those of the package: of its modules, and the components of its data base that are no blocks."""
    for found in pkgutil.walk_packages(gpac.__path__, f"{gpac.__name__}."):
        if "__main__" not in found.name:
            yield from _of(importlib.import_module(found.name))
    for component in library.list():
        if component.kind in ("graph", "verb"):
            yield component.value


def examples() -> Iterator[Any]:
    """Those at the top of the modules of the examples; the programs make theirs when they run."""
    for folder in sorted({path.parent for path in EXAMPLES.rglob("*.py")}):
        for path in sorted(folder.glob("*.py")):
            if "__main__" not in path.read_text() and "import" in path.read_text():
                name = ".".join(path.relative_to(EXAMPLES).with_suffix("").parts)
                yield from _of(importlib.import_module(name))


def _of(module: ModuleType) -> Iterator[Any]:
    yield from (value for value in vars(module).values() if isinstance(value, gpac.Graph | gpac.Verb))
