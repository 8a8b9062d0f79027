# SPDX-License-Identifier: Apache-2.0
"""Source location of a definition in the user's program: the file and line that errors show."""

from __future__ import annotations

import functools
import os
import site
import sys
import sysconfig
from types import FrameType
from typing import Any, NamedTuple

_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__))) + os.sep
_PYTHON = tuple({sysconfig.get_path(name) + os.sep for name in ("stdlib", "platstdlib")})
_INSTALLED = tuple({folder + os.sep for folder in [*site.getsitepackages(), sysconfig.get_path("purelib"), sysconfig.get_path("platlib")]})
"""Folders of installed packages within Python's own folder."""


class Place(NamedTuple):
    """A line of a program."""

    file: str
    line: int

    def json(self) -> dict[str, Any]:
        """Returns the source location in the model's format."""
        return {"file": self.file, "line": self.line}


def packaged(place: Place) -> bool:
    """Returns whether the line is in this package; if so, the line of the user's program that led to it is more informative."""
    return place.file.startswith(_PACKAGE)


def is_of_package(frame: FrameType) -> bool:
    """Returns whether a frame runs code of this package."""
    return _whose(frame.f_code.co_filename)[0] or _is_of_dataclass(frame)


def is_of_python(frame: FrameType) -> bool:
    """Returns whether a frame runs code of Python's own library."""
    return _whose(frame.f_code.co_filename)[1]


def _inside(frame: FrameType) -> bool:
    is_packaged, is_python = _whose(frame.f_code.co_filename)
    if is_packaged:
        # Module-level code of this package counts as a program: errors in its definitions are reported there.
        return frame.f_code.co_name != "<module>"
    return is_python or _is_of_dataclass(frame)


def _is_of_dataclass(frame: FrameType) -> bool:
    """Returns whether a frame is the constructor that `dataclass` generated for a class of this package; it has no file."""
    return frame.f_code.co_filename == "<string>" and str(frame.f_globals.get("__name__")).startswith("opengpac.")


@functools.lru_cache(1024)
def _whose(file: str) -> tuple[bool, bool]:
    """Returns whether a file belongs to this package, and whether it belongs to Python itself. Cached, because each call checks the same
    files."""
    return file.startswith(_PACKAGE), file.startswith("<frozen") or _is_python(file)


def _is_python(file: str) -> bool:
    """Returns whether a file belongs to Python itself: for example, `contextlib` and `functools` can be between a program and its
    callees."""
    return file.startswith(_PYTHON) and not file.startswith(_INSTALLED)


def here() -> Place:
    """Returns the nearest line on the call stack that is outside this package and Python's library, or that is a definition in this
    package."""
    frame = sys._getframe(1)
    while frame.f_back is not None and _inside(frame):
        frame = frame.f_back
    return Place(frame.f_code.co_filename, frame.f_lineno)
