# SPDX-License-Identifier: Apache-2.0
"""A user's program, run by a command: as Python would run it, and with the command told of every system that it makes."""

from __future__ import annotations

import argparse
import runpy
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .system import System


def add_to(parser: argparse.ArgumentParser) -> None:
    """The program and its arguments, the last words of a command."""
    parser.add_argument("program")
    parser.add_argument("arguments", nargs=argparse.REMAINDER)


def beside(program: str) -> None:
    """What lies beside the program can be imported, as in Python."""
    sys.path.insert(0, str(Path(program).absolute().parent))


def run(given: argparse.Namespace, name: str = "__main__") -> dict[str, Any]:
    """Runs the program to its end, as the module `name`; its global names."""
    beside(given.program)
    sys.argv = [given.program, *given.arguments]
    return runpy.run_path(given.program, run_name=name)


class Watcher:
    """What a command does with the systems of the program that it runs."""

    def made(self, system: System) -> None:
        """The program has made a system; nothing is configured yet."""

    def left(self, system: System) -> None:
        """The program leaves the system in order, and it is closed when this returns."""


_watchers: list[Watcher] = []


@contextmanager
def watched(by: Watcher) -> Iterator[None]:
    """Tells a watcher of the systems of this process meanwhile."""
    _watchers.append(by)
    try:
        yield
    finally:
        _watchers.remove(by)


def made(system: System) -> None:
    """Tells the watchers of a new system."""
    for watcher in _watchers:
        watcher.made(system)


def left(system: System) -> None:
    """Tells the watchers that a system is left in order."""
    for watcher in _watchers:
        watcher.left(system)
