# SPDX-License-Identifier: Apache-2.0
"""Source location of a definition in your program: the file and line that errors name."""

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
"""Where other packages lie, within Python's own folder."""


class Place(NamedTuple):
    """A line of a program."""

    file: str
    line: int

    def json(self) -> dict[str, Any]:
        """The form that the model takes."""
        return {"file": self.file, "line": self.line}


def packaged(place: Place) -> bool:
    """Returns whether that is a line of this package: then the line of your program that led there says more."""
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
        # What a module of this package defines is a program of its own: an error in a definition is found there.
        return frame.f_code.co_name != "<module>"
    return is_python or _is_of_dataclass(frame)


def _is_of_dataclass(frame: FrameType) -> bool:
    """Returns whether a frame is the constructor that `dataclass` makes for a class of this package: it has no file."""
    return frame.f_code.co_filename == "<string>" and str(frame.f_globals.get("__name__")).startswith("opengpac.")


@functools.lru_cache(1024)
def _whose(file: str) -> tuple[bool, bool]:
    """Returns whether a file is of this package, and whether it is Python's own. Asked in each call, of the same files."""
    return file.startswith(_PACKAGE), file.startswith("<frozen") or _is_python(file)


def _is_python(file: str) -> bool:
    """Returns whether a file is one of Python's own: `contextlib` and `functools` stand between a program and what it calls."""
    return file.startswith(_PYTHON) and not file.startswith(_INSTALLED)


def here() -> Place:
    """The nearest line outside this package and Python's own, or of a definition in it, that led to the call."""
    frame = sys._getframe(1)
    while frame.f_back is not None and _inside(frame):
        frame = frame.f_back
    return Place(frame.f_code.co_filename, frame.f_lineno)
