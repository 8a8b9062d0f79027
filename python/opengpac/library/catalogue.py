# SPDX-License-Identifier: Apache-2.0
"""Catalogue of every component by name, built when a component outside the standard library is requested for the first time."""

from __future__ import annotations

import importlib
import logging
import os
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

from ..errors import CallError, DefinitionError, UnknownName, did_you_mean, refuse
from .components import Component, Found, Problem, block_component
from .origins import Entry, of_packages, of_thing, of_users, standard, standard_blocks

_logger = logging.getLogger("opengpac")


class Catalogue:
    """Available components; `problems` lists those left out, with reasons."""

    def __init__(self) -> None:
        self._components: list[Component] | None = None
        self._problems: list[Problem] = []
        self._added: list[tuple[Any, str]] = []

    def components(self) -> list[Component]:
        """Returns all components, starting with the standard library."""
        if self._components is None:
            self._components, self._problems = [], []
            added = (entry for given, origin in self._added for entry in of_thing(given, origin, origin))
            for origin in (standard(), of_packages(), of_users(), added):
                self._take(origin)
        return self._components

    def problems(self) -> list[Problem]:
        """Returns the problems of components that could not be added."""
        self.components()
        return self._problems

    def find(self, name: str, kind: str | None = None, what: str = "component") -> Component:
        """Returns the component with that name. Refuses an ambiguous name, and names both components. `what` names the component in
        error messages."""
        short = name.removeprefix("library.")
        if short in standard_blocks():
            block, category = standard_blocks()[short]
            return block_component(block, category, "library")
        matches = [c for c in self.components() if short in c.names and kind in (None, c.kind)]
        exact = [c for c in matches if short in c.names[1:]] or matches
        if len(exact) > 1:
            refuse(
                UnknownName,
                f"'{name}' is the name of {' and of '.join(f'a {c.kind} of {c.where}' for c in exact)}",
                f"write {' or '.join(repr(_only_name(c, exact)) for c in exact)}",
            )
        if not exact:
            self._refuse(name, what)
        return exact[0]

    def add(self, given: str | os.PathLike[str] | ModuleType, origin: str | None) -> Found:
        """Adds components as described in `library.add`."""
        if not isinstance(given, ModuleType):
            if not isinstance(given, str | os.PathLike):
                refuse(
                    CallError, f"library.add() needs the path of a folder or file, or a Python module, not {given!r}", "pass one of those"
                )
            given = Path(given).expanduser().absolute()
        name = origin or (given.__name__.rsplit(".", 1)[-1] if isinstance(given, ModuleType) else given.stem)
        entries = list(of_thing(given, name, f"'{given}'"))
        new = [e for e in entries if isinstance(e, Component)]
        broken = [e for e in entries if isinstance(e, Problem)]
        if not new:
            reason = "; ".join(str(problem) for problem in broken) or f"'{given}' contains no components"
            refuse(DefinitionError, f"nothing was added: {reason}")
        again = [(g, n) for g, n in self._added if (g, n) != (given, name)]
        others = [c for c in self.components() if (c.origin, c.source) not in {(n.origin, n.source) for n in new}]
        for component in new:
            clash = next((c for c in others if _clash(component, c)), None)
            if clash is not None:
                refuse(
                    DefinitionError,
                    f"nothing was added: '{component.short_name}' names both a {component.kind} of {component.where} and "
                    f"a {clash.kind} of {clash.where}",
                    f"rename your {component.kind}",
                )
        self._added = [*again, (given, name)]
        self._components, self._problems = [*others, *new], [*self._problems, *broken]
        _warn(broken)
        return Found(new)

    def refresh(self) -> None:
        """Discards the components found outside the standard library; the next request rereads files and packages."""
        self._components = None
        importlib.invalidate_caches()

    def _take(self, entries: Iterable[Entry]) -> None:
        assert self._components is not None
        taken, problems = [], []
        for entry in entries:
            if isinstance(entry, Problem):
                problems.append(entry)
                continue
            if any(c.value is entry.value for c in self._components):
                continue
            if entry.short_name in standard_blocks() and entry.origin != "library":
                reason = f"a {entry.kind} of {entry.where} has the name of a block of the standard library and must be renamed"
                problems.append(Problem(f"'{entry.name}'", reason))
                continue
            taken.append(entry)
        self._components += taken
        self._problems += problems
        _warn(problems)

    def _refuse(self, name: str, what: str) -> None:
        # Suggest short names for a short name.
        known = [n for c in self.components() for n in (c.names if "." in name else c.names[:1])]
        meant = did_you_mean(name, dict.fromkeys(known))
        remedy = meant if meant.startswith("did you mean") else "search for one with opengpac blocks search WORDS"
        if self._problems:
            remedy += "; not loaded: " + "; ".join(str(problem) for problem in self._problems)
        refuse(UnknownName, f"the library has no {what} '{name}'", remedy)


def _clash(new: Component, other: Component) -> bool:
    """Returns whether a shared name would be ambiguous. Verbs and graphs can be distinguished by their origins."""
    same = new.short_name == other.short_name
    return new.name == other.name or (same and other.kind == "block" and (new.kind == "block" or other.origin == "library"))


def _only_name(component: Component, others: list[Component]) -> str:
    """Returns a name that only this component has."""
    return next((n for n in component.names if sum(n in c.names for c in others) == 1), component.name)


def _warn(problems: Iterable[Problem]) -> None:
    for problem in problems:
        _logger.warning("not loaded into the component database: %s", problem)


CATALOGUE = Catalogue()
