# SPDX-License-Identifier: Apache-2.0
"""Every graph and verb of the library, the examples and the graphs of the mappings."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import pkgutil
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock

import opengpac as gpac
from opengpac import library
from opengpac.checking import check
from opengpac.definition.entering import Definitions

EXAMPLES = Path(__file__).parents[3] / "examples"
SHORT = {"reach_training": ["--steps", "1", "--output", os.devnull]}
"""Arguments with which a program computes little and leaves nothing behind."""


def packaged() -> Iterator[Any]:
    """Yields the definitions of the package: those of its modules, and the components of its database that are not blocks."""
    for found in pkgutil.walk_packages(gpac.__path__, f"{gpac.__name__}."):
        if "__main__" not in found.name:
            yield from _of(importlib.import_module(found.name))
    for component in library.list():
        if component.kind in ("graph", "verb"):
            yield component.value


def examples() -> list[Any]:
    """Returns the definitions that the example programs enter in their systems. The programs are followed as by `opengpac check`, which
    must find no fault; nothing runs."""
    entered: list[Any] = []
    enter = Definitions.enter_verb

    def entering(self: Definitions, verb: Any) -> None:
        entered.append(verb)
        enter(self, verb)

    with mock.patch.object(Definitions, "enter_verb", entering), contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        # Plots and means of empty data: the verbs have not run.
        warnings.simplefilter("ignore")
        for path in sorted(EXAMPLES.glob("*.py")):
            findings = check(str(path), SHORT.get(path.stem, []))
            assert not (findings.errors or findings.broken), f"{path.name}: {findings.errors or findings.broken}"
    return entered


def _of(module: ModuleType) -> Iterator[Any]:
    yield from (value for value in vars(module).values() if isinstance(value, gpac.Graph | gpac.Verb))
