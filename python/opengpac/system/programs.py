# SPDX-License-Identifier: Apache-2.0
"""Runs a user's program for a command, as Python would, but reports every system that the program creates to the command."""

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


def add_to(parser: argparse.ArgumentParser, **of_program: Any) -> None:
    """Adds the program and its arguments as the last arguments of a command line."""
    parser.add_argument("program", **of_program)
    parser.add_argument("arguments", nargs=argparse.REMAINDER)
    parser.set_defaults(_command=parser)


def beside(program: str) -> None:
    """Makes modules next to the program importable, as in Python."""
    sys.path.insert(0, str(Path(program).absolute().parent))


def run(given: argparse.Namespace, name: str = "__main__") -> dict[str, Any]:
    """Runs the program to completion, as the module `name`; returns its global names."""
    _note_options_behind(given)
    beside(given.program)
    sys.argv = [given.program, *given.arguments]
    return runpy.run_path(given.program, run_name=name)


def _note_options_behind(given: argparse.Namespace) -> None:
    """Prints a note that options after the program are passed to the program, if the command has an option with the same name."""
    behind = {word.split("=", 1)[0] for word in given.arguments}
    for action in given._command._actions:
        meant = behind.intersection(action.option_strings)
        if meant and action.dest != "help" and getattr(given, action.dest) == action.default:
            note = f"note: {min(meant)} follows '{given.program}' and is passed to the program; write options of the command before it"
            print(note, file=sys.stderr)


class Watcher:
    """Hooks of a command for the systems of the program that it runs."""

    def made(self, system: System) -> None:
        """Called when the program has created a system, before anything is configured in it."""

    def left(self, system: System) -> None:
        """Called when the program leaves the system normally; the system is closed when this returns."""


_watchers: list[Watcher] = []


@contextmanager
def watched(by: Watcher) -> Iterator[None]:
    """Reports the systems of this process to a watcher during the `with` block."""
    _watchers.append(by)
    try:
        yield
    finally:
        _watchers.remove(by)


def made(system: System) -> None:
    """Reports a new system to the watchers."""
    for watcher in _watchers:
        watcher.made(system)


def left(system: System) -> None:
    """Reports to the watchers that a program is leaving a system normally."""
    for watcher in _watchers:
        watcher.left(system)
