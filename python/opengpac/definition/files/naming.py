# SPDX-License-Identifier: Apache-2.0
"""Classes and functions that a file refers to by name: `module:Class`, or just the name if it is a public name of this package.

Only modules of this package are imported for a name; other names are looked up among the objects that the program passes.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from typing import Any

from ...errors import DefinitionError, did_you_mean, refuse

Given = Mapping[str, Any] | Iterable[Any] | None
_PACKAGE = __name__.split(".", 1)[0]


def name_of(of: Any, what: str) -> str:
    """Returns the name by which a class or function can be looked up again; `what` names it in refusals."""
    shown = importlib.import_module(_PACKAGE)
    if getattr(shown, getattr(of, "__name__", ""), None) is of:
        return of.__name__
    module, name = getattr(of, "__module__", ""), getattr(of, "__qualname__", "")
    if not module or not name or "<" in name:
        refuse(
            DefinitionError,
            f"{what} is {of!r}, which has no name by which a file could refer to it",
            "define it by name at the top level of a module",
        )
    return f"{module}:{name}"


class Names:
    """Objects that a program passes to resolve names in a file, and the objects of the package itself."""

    def __init__(self, given: Given, base: type | None) -> None:
        named = given.items() if isinstance(given, Mapping) else ((None, of) for of in given or ())
        self._known: dict[str, Any] = {}
        self._base = base
        for name, of in named:
            own = getattr(of, "__qualname__", str(of))
            for key in (f"{getattr(of, '__module__', '')}:{own}", own) if name is None else (name,):
                self._known[key] = of

    def find(self, name: str) -> Any | None:
        """Returns the object of that name, or None."""
        short = name.rpartition(":")[2]
        found = self._known.get(name, self._known.get(short))
        return found if found is not None else self._own(name)

    def remedy(self, name: str, argument: str) -> str:
        """Returns the remedy that the refusal of an unknown name shows."""
        near = did_you_mean(name.rpartition(":")[2], [*self._known, *self._shown()])
        give = f"pass it: gpac.load(…, {argument}={{'{name}': …}})"
        return f"{near} or {give}" if near.startswith("did you mean") else give

    def _shown(self) -> list[str]:
        shown = importlib.import_module(_PACKAGE)
        return [name for name in shown.__all__ if self._base is not None and self._fits(getattr(shown, name, None))]

    def _fits(self, of: Any) -> bool:
        return callable(of) if self._base is None else isinstance(of, type) and issubclass(of, self._base)

    def _own(self, name: str) -> Any | None:
        module, _, path = name.rpartition(":")
        if module and module != _PACKAGE and not module.startswith(f"{_PACKAGE}."):
            return None
        try:
            found: Any = importlib.import_module(module or _PACKAGE)
            for part in path.split("."):
                found = getattr(found, part)
        except (ImportError, AttributeError):
            return None
        return found if self._fits(found) and self._is_own(found, path) else None

    def _is_own(self, of: Any, path: str) -> bool:
        """Returns whether the object belongs to this package; a function must belong to one of the motion modules."""
        home = f"{_PACKAGE}.motion." if self._base is None else f"{_PACKAGE}."
        return of.__module__.startswith(home) and of.__qualname__ == path
