# SPDX-License-Identifier: Apache-2.0
"""Processes that are started for one purpose: how this installation starts one."""

from __future__ import annotations

import sys

from .. import _native

# Loads the compiled core alone: the process needs nothing else of the package, and starts in some milliseconds.
_BODY = """\
import importlib.machinery, importlib.util, sys
loader = importlib.machinery.ExtensionFileLoader("opengpac._native", sys.argv[1])
spec = importlib.util.spec_from_file_location("opengpac._native", sys.argv[1], loader=loader)
native = importlib.util.module_from_spec(spec)
loader.exec_module(native)
sys.exit(getattr(native, sys.argv[2])())
"""


def command(entry: str) -> list[str]:
    """Returns the command of a process that calls `_native.ENTRY()` and ends when that returns; a returned text is why it failed."""
    return [sys.executable, "-I", "-S", "-c", _BODY, _native.__file__, entry]


def command_with_package(entry: str) -> list[str]:
    """Returns the command of a process that needs the package too, as one in which a driver in Python runs."""
    return [sys.executable, "-c", "import sys; from opengpac import _native; sys.exit(getattr(_native, sys.argv[1])())", entry]


def processes_json() -> dict[str, object]:
    """Returns how processors get processes, as a system is told."""
    return {"command": command("run_processor"), "guard": command("run_guard"), "replay": command("run_replay"), "python": sys.executable}
