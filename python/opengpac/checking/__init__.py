# SPDX-License-Identifier: Apache-2.0
"""`opengpac check PROGRAM.py`: executes the program and performs every installation check, but starts no verb.

Verbs are planned instead of started; a call returns a report with zeros for its outputs, so that the program continues.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from typing import Any

from ..errors import Error
from .following import ABSENT, Missing, follow
from .mistakes import BrokenStatement


@dataclass
class Findings:
    """Findings of a check: the planned verbs, the values filled in for them, and the errors."""

    planned: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    errors: list[Error] = field(default_factory=list)
    broken: list[BrokenStatement] = field(default_factory=list)
    """Statements that raised an ordinary Python exception; they and their dependents remain unchecked."""
    names: dict[str, Any] = field(default_factory=dict)
    """Names that the program binds."""
    recordings: dict[str, tuple[Any, dict[str, Any]]] = field(default_factory=dict)
    """Recordings that the program would have made, by file: the system and the options."""


_findings: Findings | None = None


def active() -> bool:
    """Returns whether a program is being checked."""
    return _findings is not None


def would_record(file: str, system: Any, options: dict[str, Any]) -> None:
    """Stores a recording that a run would make, for a program that later reads it."""
    if _findings is not None:
        _findings.recordings[file] = (system, options)


def recorded(file: str) -> tuple[Any, dict[str, Any]] | None:
    """Returns the system and the options of a recording that a run would have made before this line; None if the program does not record
    that file."""
    return None if _findings is None else _findings.recordings.get(file)


def found() -> Findings:
    """Returns the findings of the current check, to which callers add. If no check is running, additions are discarded."""
    return _findings if _findings is not None else Findings()


def check(path: str, arguments: list[str]) -> Findings:
    """Checks the program in the file at `path`; returns all of its errors, in the order in which they were found."""
    global _findings
    _findings, before = Findings(), sys.argv
    sys.argv = [path, *arguments]
    try:
        follow(path, note, _findings.names, lambda error, first, last: _break(path, error, (first, last)))
    except SystemExit:
        pass
    except Exception as error:
        # The exception also left the enclosing block: nothing that follows was executed.
        with open(path, "rb") as file:
            _break(path, error, (0, len(file.read().splitlines())))
    finally:
        findings, _findings, sys.argv = _findings, None, before
    return findings


def _break(path: str, error: Exception, lines: tuple[int, int]) -> None:
    """Records an ordinary Python exception that aborted the statement on these lines."""
    if _findings is not None and not isinstance(error, Missing):
        _findings.broken.append(BrokenStatement(error, path, _findings.names or vars(sys.modules["__main__"]), lines))


def note(error: Error) -> None:
    """Records an error once: a definition is registered in each system that uses it, and each refuses it for the same reason."""
    if _findings is not None and repr(ABSENT) not in str(error):
        known = {(type(e), str(e)) for e in _findings.errors}
        _findings.errors += [e for e in getattr(error, "errors", [error]) if (type(e), str(e)) not in known]
