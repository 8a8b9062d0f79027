# SPDX-License-Identifier: Apache-2.0
"""Judgement of `opengpac check` on an exception of Python's own: a mistake that every run would make too, or one that may be owed to the
values which stand in for those of a run.
"""

from __future__ import annotations

import builtins
import inspect
import re
import sys
import traceback
import types
from collections.abc import Iterable, Mapping
from typing import Any

from .. import _native
from ..errors import Error
from ..refusals.source_location import Place, packaged

_CALLED = re.compile(r"([\w.]+)\(\) (got|missing|takes) ")
_PACKAGE = __name__.partition(".")[0]
_KEYWORD = re.compile(r"([\w.]+)\(\) got an unexpected keyword argument '(\w+)'")


class BrokenStatement(Error):
    """An exception of Python's own that ended the statement on these lines; `kind` is its class. 0 for the first: where it was raised."""

    def __init__(self, error: Exception, path: str, names: Mapping[str, Any], lines: tuple[int, int]) -> None:
        place = _place(error, path, lines[1])
        self.certain = _is_certain(error)
        """Whether a run would end there too."""
        super().__init__(_message(error), remedy=_meant(error, names) if self.certain else "", place=place)
        self.kind = type(error).__name__
        self.lines = (lines[0] or place.line, lines[1])
        if isinstance(error, SyntaxError) and place.file == path:
            # Nothing of a file that cannot be read was done.
            self.lines = (1, lines[1])

    def left_out(self) -> str:
        """The lines of which nothing is known by it."""
        first, last = self.lines
        return f"line {first}" if first >= last else f"lines {first} to {last}"


def _place(error: Exception, path: str, last: int) -> Place:
    """The line of the program: of what cannot be read, where that is; else the innermost of its own."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        return Place(error.filename, error.lineno or 1)
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
    return Place(path, (lines[-1] if lines else None) or last)


def _message(error: Exception) -> str:
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    # Where a module lies does not help.
    text = re.sub(r" \(\S+\)$", "", text) if isinstance(error, ImportError) else text
    return text or "no more is said of it"


def _is_certain(error: Exception) -> bool:
    """Returns whether no value of a run could have avoided it."""
    if isinstance(error, SyntaxError | NameError | ImportError):
        return True
    if isinstance(error, AttributeError):
        return isinstance(error.obj, types.ModuleType)
    last = traceback.extract_tb(error.__traceback__)[-1:]
    outside = not any(packaged(Place(frame.filename, 1)) for frame in last)
    return isinstance(error, TypeError) and outside and _CALLED.match(str(error)) is not None


def _meant(error: Exception, names: Mapping[str, Any]) -> str:
    """Returns `did you mean 'blocks'?`, where something is close."""
    word, known = _asked(error, names)
    close = _native.nearest(word.encode(errors="replace").decode(), [str(name) for name in known]) if word else None
    return f"did you mean '{close}'?" if close else ""


def _asked(error: Exception, names: Mapping[str, Any]) -> tuple[str, Iterable[str]]:
    """The word that does not fit, and those that would."""
    if isinstance(error, NameError):
        return error.name or "", [*names, *dir(builtins)]
    if isinstance(error, ImportError):
        word = re.search(r"cannot import name '(\w+)'", str(error))
        return (word[1] if word else ""), dir(sys.modules.get(error.name or ""))
    if isinstance(error, AttributeError):
        return error.name or "", dir(error.obj)
    given = _KEYWORD.match(str(error))
    return (given[2], _parameters(given[1])) if given else ("", [])


def _parameters(name: str) -> list[str]:
    """The parameters of what has that qualified name in this package; none where there is no such thing."""
    for module in [module for key, module in sys.modules.items() if key.split(".")[0] == _PACKAGE]:
        found: Any = module
        for part in name.split("."):
            found = getattr(found, part, None) if found is not None else None
        if callable(found):
            return [*inspect.signature(found).parameters]
    return []
