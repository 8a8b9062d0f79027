# SPDX-License-Identifier: Apache-2.0
"""Commands by which this installation starts processes for special purposes."""

from __future__ import annotations

import sys

from .. import _native

# Loads only the compiled core: the process needs no other part of the package, and starts in a few milliseconds.
_BODY = """\
import importlib.machinery, importlib.util, sys
loader = importlib.machinery.ExtensionFileLoader("opengpac._native", sys.argv[1])
spec = importlib.util.spec_from_file_location("opengpac._native", sys.argv[1], loader=loader)
native = importlib.util.module_from_spec(spec)
loader.exec_module(native)
sys.exit(getattr(native, sys.argv[2])())
"""


def command(entry: str) -> list[str]:
    """Returns the command for a process that calls `_native.ENTRY()` and exits when that returns; if it returns a text, that is the
    reason for the failure."""
    return [sys.executable, "-I", "-S", "-c", _BODY, _native.__file__, entry]


def command_with_package(entry: str) -> list[str]:
    """Returns the command for a process that also needs the package, such as one that runs a driver in Python."""
    return [sys.executable, "-c", "import sys; from opengpac import _native; sys.exit(getattr(_native, sys.argv[1])())", entry]


def processes_json() -> dict[str, object]:
    """Returns the commands that start the processes of processors, in the format that the system expects."""
    return {"command": command("run_processor"), "guard": command("run_guard"), "replay": command("run_replay"), "python": sys.executable}
