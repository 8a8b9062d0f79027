# SPDX-License-Identifier: Apache-2.0
"""Origins of components: the standard library, OpenGPAC's own packages, other packages through their entry points, and the user's
folders. A component that cannot be added becomes a `Problem` and does not affect the others."""

from __future__ import annotations

import functools
import importlib
import itertools
import json
import os
import pkgutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .. import _native
from ..definition.blocks import Block
from ..definition.entering import without_system
from ..errors import Error, refusals
from ..storage.files import is_source
from ..storage.process_folders import process_folder
from .components import Component, Problem, block_component, members

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "opengpac.components"
"""Entry point group for packages that provide components."""

_PACKAGE = "opengpac"

Entry = Component | Problem


@functools.cache
def standard_blocks() -> Mapping[str, tuple[Block, str]]:
    """Returns the blocks of the standard library by short name, each with its category, which is the folder of its file."""
    found: dict[str, tuple[Block, str]] = {}
    for interface in json.loads(_native.library_json()):
        folder = Path(interface.get("file", "")).parent.name
        found[interface["name"].split(".", 1)[1]] = (Block(interface), folder)
    return found


def standard() -> Iterator[Entry]:
    """Yields the standard library, and the public components of OpenGPAC's sub-packages: `robots.move`, `robots.Joint`."""
    for block, category in standard_blocks().values():
        yield block_component(block, category, "library")
    package = importlib.import_module(_PACKAGE)
    for found in pkgutil.iter_modules(package.__path__):
        if found.ispkg and found.name != "library":
            yield from _imported(f"{_PACKAGE}.{found.name}", found.name, "library")


def of_packages() -> Iterator[Entry]:
    """Yields the components that installed packages declare in the entry point group."""
    from importlib.metadata import entry_points

    points = {(point.name, point.value): point for point in entry_points(group=GROUP)}
    for _, point in sorted(points.items()):
        yield from of_entry_point(point)


def of_entry_point(point: EntryPoint) -> Iterator[Entry]:
    """Yields the components of a module (its public graphs, verbs and device types, and the C files next to it), or of a folder or file."""
    what = f"package '{point.dist.name if point.dist else point.name}', entry point '{point.name} = {point.value}'"
    try:
        given = point.load()
        yield from of_thing(given, point.name, what)
    except Exception as error:
        # Arbitrary failures of other packages on import must not disable the data base.
        yield Problem(what, f"{type(error).__name__}: {error}")


def of_thing(given: Any, origin: str, what: str) -> Iterator[Entry]:
    """Yields the components of a module or path."""
    if isinstance(given, ModuleType):
        yield from members(given, origin, origin)
        for folder in getattr(given, "__path__", []):
            yield from of_path(Path(folder), origin)
    elif isinstance(given, str | os.PathLike):
        yield from of_path(Path(given), origin)
    else:
        yield Problem(what, f"{given!r} is neither a module nor the path of a folder")


def user_folders() -> list[Path]:
    """Returns the folders in `OPENGPAC_PATH`, followed by `opengpac/components` in the user's configuration directory."""
    named = [Path(folder).expanduser() for folder in os.environ.get("OPENGPAC_PATH", "").split(os.pathsep) if folder]
    configuration = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "opengpac" / "components"
    return [*named, *([configuration] if configuration.is_dir() else [])]


def of_users() -> Iterator[Entry]:
    """Yields the components in the user's folders."""
    for folder in user_folders():
        yield from of_path(folder, folder.absolute().name)


def of_path(path: Path, origin: str) -> Iterator[Entry]:
    """Yields the blocks of a code module, or of each code module in a folder."""
    if not path.exists():
        yield Problem(f"'{path}'", "no such file or folder exists")
    for file in sorted(path.iterdir()) if path.is_dir() else [path] if path.exists() else []:
        if path.is_dir() and not _is_code(file):
            continue
        try:
            yield from _of_file(file.absolute(), origin)
        except Error as error:
            yield Problem(f"'{file}'", f"{type(error).__name__}: {error.message}")


def _is_code(file: Path) -> bool:
    """Returns whether a file of a folder is a code module: C or C++ with `opengpac.h`, or a shared object that is not a Python
    extension."""
    if is_source(file):
        return "opengpac.h" in file.read_text(errors="replace")
    return file.suffix == ".so" and ".abi3" not in file.name and ".cpython" not in file.name


def _of_file(file: Path, origin: str) -> Iterator[Component]:
    module = f"{origin.replace('.', '_')}:{file.stem.removeprefix('lib')}"
    code = _built(file) if is_source(file) else file
    for interface in without_system().enter_module(module, str(code)):
        yield block_component(Block(interface, str(code)), origin, origin, str(file))


_builds = itertools.count()


def _built(file: Path) -> Path:
    """Builds a source file once for all systems of this process; after a refresh, the file is built again under another name."""
    built = process_folder("components") / f"{file.stem}-{next(_builds)}.so"
    with refusals:
        _native.build([str(file)], str(built))
    return built


def _imported(module: str, prefix: str, origin: str) -> Iterator[Entry]:
    try:
        yield from members(importlib.import_module(module), prefix, origin)
    except ImportError as error:
        yield Problem(f"package '{module}'", str(error))
