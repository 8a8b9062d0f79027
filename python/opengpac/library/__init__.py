# SPDX-License-Identifier: Apache-2.0
"""The component data base: every block of the standard library is an attribute, `library.pid`, as is every component of other packages
and of the user's own folders. `list()`, `search("low-pass")` and `show("pid")` also cover graphs, verbs and device types.
>>> from opengpac import library as lib
>>> lib.lowpass.name
'library.lowpass'
>>> lib.search("low-pass")[0].name
'lowpass'
>>> lib.pid.run(kp=2.0, setpoint=1.0, measured=0.25).effort
array([1.5])
"""

from __future__ import annotations

import builtins
import os
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

from ..definition.blocks import Block
from ..refusals.argument_types import taking
from .catalogue import CATALOGUE
from .components import Component, Found, Problem
from .manuals import Manual, manual
from .origins import standard_blocks
from .padding import padded
from .searching import ranked

__all__ = [
    "Component", "Found", "Manual", "Problem", "add", "block", "blocks", "get", "list", "padded", "problems", "refresh", "search", "show",
]  # fmt: skip


def list(category: str | None = None) -> Found:
    """Returns every component by category and name, or those of one `category`."""
    order = sorted(CATALOGUE.components(), key=lambda c: (c.origin != "library", c.category, c.name))
    return Found(c for c in order if category in (None, c.category))


def search(*words: str) -> Found:
    """Returns the components that contain all these `words` in their name, documentation, ports or parameters, best match first."""
    return ranked(CATALOGUE.components(), [part for word in words for part in word.split()])


def show(name: str) -> Manual:
    """Returns the manual of the component `name`: equation, ports, parameters, conditions, faults, an example. A notebook prints it at
    the end of a cell."""
    return manual(CATALOGUE.find(name))


def get(name: str) -> Any:
    """Returns the component called `name`: a block, graph, verb or device type. Raises `UnknownName` if it does not exist or is
    ambiguous."""
    return CATALOGUE.find(name).value


@taking
def block(name: str) -> Block:
    """Returns the block called `name`: `pid`, `library.pid`, or `their_package.their_block`."""
    return CATALOGUE.find(name, "block", "block").value


def blocks() -> Mapping[str, Block]:
    """Returns every block of the standard library by its short name."""
    return {name: found for name, (found, _) in standard_blocks().items()}


def add(path: str | os.PathLike[str] | ModuleType, name: str | None = None) -> Found:
    """Adds the code modules at `path`: a folder (C and C++ files with `opengpac.h`, compiled modules), one file, or the public graphs,
    verbs and device types of a Python module. Components are named `name.block`, or just `block`; `name` defaults to the name of the
    folder or module.

    If a name is in use, refuses it with the names of both components, and adds nothing. A file that cannot be built is listed in
    `problems()`, and does not affect the rest. To add a folder permanently, list it in `OPENGPAC_PATH`.
    """
    return CATALOGUE.add(path, name)


def problems() -> Sequence[Problem]:
    """Returns the components that could not be added, with reasons: files that cannot be built, packages that cannot be imported, name
    clashes."""
    return CATALOGUE.problems()


def refresh() -> None:
    """Makes the next request reread files and packages, for example in a notebook after an edit."""
    CATALOGUE.refresh()


def __getattr__(name: str) -> Block:
    if name.startswith("_"):
        raise AttributeError(name)
    return CATALOGUE.find(name, what="block").value


def __dir__() -> builtins.list[str]:
    return [*blocks(), *__all__]
