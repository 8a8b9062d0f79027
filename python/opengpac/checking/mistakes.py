# SPDX-License-Identifier: Apache-2.0
"""Classifies ordinary Python exceptions for `opengpac check`: errors that every run would raise too, and possible artefacts of the
placeholder values of a check."""

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
    """An ordinary Python exception, of class `kind`, that aborted the statement on these lines. A first line of 0 stands for the line
    that raised the exception."""

    def __init__(self, error: Exception, path: str, names: Mapping[str, Any], lines: tuple[int, int]) -> None:
        place = _place(error, path, lines[1])
        self.certain = _is_certain(error)
        """True if a run would fail at the same statement."""
        super().__init__(_message(error), remedy=_meant(error, names) if self.certain else "", place=place)
        self.kind = type(error).__name__
        self.lines = (lines[0] or place.line, lines[1])
        if isinstance(error, SyntaxError) and place.file == path:
            # No line of a file with a syntax error was executed.
            self.lines = (1, lines[1])

    def left_out(self) -> str:
        """Lines that the error left unchecked."""
        first, last = self.lines
        return f"line {first}" if first >= last else f"lines {first} to {last}"


def _place(error: Exception, path: str, last: int) -> Place:
    """Returns the program line of an error. For a syntax error, this is the line that cannot be parsed; otherwise, it is the line of the
    program's innermost frame."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        return Place(error.filename, error.lineno or 1)
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
    return Place(path, (lines[-1] if lines else None) or last)


def _message(error: Exception) -> str:
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    # The location of the module does not help.
    text = re.sub(r" \(\S+\)$", "", text) if isinstance(error, ImportError) else text
    return text or "the exception has no message"


def _is_certain(error: Exception) -> bool:
    """Returns whether the error would occur regardless of the values in a run."""
    if isinstance(error, SyntaxError | NameError | ImportError):
        return True
    if isinstance(error, AttributeError):
        return isinstance(error.obj, types.ModuleType)
    last = traceback.extract_tb(error.__traceback__)[-1:]
    outside = not any(packaged(Place(frame.filename, 1)) for frame in last)
    return isinstance(error, TypeError) and outside and _CALLED.match(str(error)) is not None


def _meant(error: Exception, names: Mapping[str, Any]) -> str:
    """Returns the hint `did you mean 'blocks'?` if a similar name exists."""
    word, known = _asked(error, names)
    close = _native.nearest(word.encode(errors="replace").decode(), [str(name) for name in known]) if word else None
    return f"did you mean '{close}'?" if close else ""


def _asked(error: Exception, names: Mapping[str, Any]) -> tuple[str, Iterable[str]]:
    """Returns the unknown name and the valid alternatives."""
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
    """Returns the parameters of the object in this package with that qualified name; empty if it does not exist."""
    for module in [module for key, module in sys.modules.items() if key.split(".")[0] == _PACKAGE]:
        found: Any = module
        for part in name.split("."):
            found = getattr(found, part, None) if found is not None else None
        if callable(found):
            return [*inspect.signature(found).parameters]
    return []
