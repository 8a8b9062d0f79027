# SPDX-License-Identifier: Apache-2.0
"""Workspaces: layouts of panels that a program ships with its system for the studio."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from .. import _native, checking
from ..errors import CallError, FileFailed, refusals, refuse
from ..refusals.argument_types import all_taking
from ..refusals.declared_names import DeclaredNames
from ..storage import files
from ..values.tables import Table, TableDisplay

if TYPE_CHECKING:
    from ..system.system import System

FORMAT = 1
"""Version of the file format, declared in a file as `"workspace": 1`."""

File = str | os.PathLike[str]


@all_taking
class Workspaces(TableDisplay, DeclaredNames):
    """Workspaces of a system, `cell.workspaces`: layouts, by name, that programs ship and users store in the studio.

    A layout is a JSON file, or an equivalent dictionary; `docs/workspaces.md` describes it.
    >>> import opengpac as gpac
    >>> cell = gpac.System("cell", clock="virtual")
    >>> level = cell.svv("level", float, unit="m")
    >>> cell.workspaces.ship({"name": "tank", "layout": {"panel": "values", "values": [{"name": "level", "maximum": 2.0}]}})
    >>> cell.workspaces
    tank  shipped
    """

    def __init__(self, system: System) -> None:
        self._system = system

    def _called(self) -> str:
        return f"the workspaces of system '{self._system.name}'"

    def ship(self, workspace: File | Mapping[str, Any]) -> None:
        """Registers a workspace that this program ships; replaces the one previously shipped under its name.

        `workspace` is a file, or its contents. All names in it must exist: verbs, verb instances, SVVs, physical devices. Unknown
        names are refused, each with a suggestion, and nothing is registered; a name under which a user has stored a workspace is
        refused too.
        """
        given = read(workspace)
        self._check(given)
        with refusals:
            self._system._alive().ship_workspace(given)

    def check(self, workspace: File | Mapping[str, Any]) -> None:
        """Raises the errors of a `workspace`: errors in its format, and unknown names. Registers nothing."""
        self._check(read(workspace))

    def _check(self, given: dict[str, Any]) -> None:
        with refusals:
            found = self._system._alive().check_workspace(given)
            if checking.active():
                # Nothing runs in a check: the instances that the program makes do not exist.
                found = [one for one in found if "no verb instance" not in one["message"]]
            if found:
                raise _native.Refused(json.dumps(found))

    def withdraw(self, name: str) -> None:
        """Removes the workspace `name` that a program has shipped. Raises `UnknownName` if it does not exist, `InUse` if a user has
        stored it."""
        with refusals:
            self._system._alive().withdraw_workspace(name)

    def forget(self, name: str) -> None:
        """Removes the workspace `name` that a user has stored. Raises `UnknownName` if it does not exist, `InUse` if a program has
        shipped it."""
        with refusals:
            self._system._alive().forget_workspace(name)

    def save(self, name: str, path: File) -> None:
        """Writes the workspace `name` to the file at `path`, in the format that `ship` reads, so that a program can ship a layout
        composed in the studio."""
        text = json.dumps({"workspace": FORMAT, **self[name]}, indent=2, ensure_ascii=False) + "\n"
        files.write(files.path_of(path, "save"), text, "the workspace")

    def __getitem__(self, name: str) -> dict[str, Any]:
        """Returns a workspace as the contents of a file."""
        with refusals:
            return self._system._alive().workspace(name)

    def __iter__(self) -> Iterator[str]:
        return iter([about["name"] for about in self._about()])

    def __len__(self) -> int:
        return len(self._about())

    def __contains__(self, name: object) -> bool:
        return name in list(self)

    def _about(self) -> list[dict[str, Any]]:
        with refusals:
            return self._system._alive().workspaces()

    def __repr__(self) -> str:
        if self._system.closed:
            return f"workspaces of the closed system '{self._system.name}'"
        rows = [(about["name"], "; ".join(_words(about))) for about in self._about()]
        width = max((len(name) for name, _ in rows), default=0)
        return "\n".join(f"{name:<{width}}  {words}" for name, words in rows) if rows else "no workspaces"

    def _table(self) -> Table | None:
        if self._system.closed or not (shown := self._about()):
            return None
        return Table("workspaces", ["name", "title", "kind"], [(a["name"], a["title"], ", ".join(_words(a))) for a in shown])

    def _ipython_key_completions_(self) -> list[str]:
        return [] if self._system.closed else [*self]


def _words(about: Mapping[str, Any]) -> list[str]:
    kind = ["shipped" if about["shipped"] else "kept"]
    return [*kind, "for operators"] if about["operator"] else kind


def read(workspace: File | Mapping[str, Any]) -> dict[str, Any]:
    """Reads a workspace from a file or a mapping, and removes the format version. Raises `FileFailed` with the file and line."""
    given: Any = workspace
    at = "the workspace"
    if not isinstance(workspace, Mapping):
        path = files.path_of(workspace, "a workspace")
        at = f"'{path}'"
        text = files.read(path, "the workspace")
        if text is None:
            refuse(FileFailed, f"file {at} does not exist", "pass the path of a workspace that the studio exported")
        try:
            given = json.loads(text)
        except (ValueError, RecursionError) as error:
            why = "its objects and lists are nested too deeply" if isinstance(error, RecursionError) else error
            refuse(FileFailed, f"{at} is not a workspace: {why}", "write it as JSON, as in docs/workspaces.md")
    if not isinstance(given, Mapping) or not isinstance(given.get("layout"), Mapping):
        refuse(CallError, f"{at} has no 'layout'", 'write {"workspace": 1, "name": NAME, "layout": {…}}')
    version = given.get("workspace", FORMAT)
    if version != FORMAT:
        refuse(
            CallError,
            f"{at} has version {version!r} of the workspace format, but this OpenGPAC reads version {FORMAT}",
            f'write "workspace": {FORMAT}',
        )
    return {key: value for key, value in given.items() if key != "workspace"}
