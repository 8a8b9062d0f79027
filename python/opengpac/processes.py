# SPDX-License-Identifier: Apache-2.0
"""Processes for processors: how this installation starts one."""

from __future__ import annotations

import sys

from . import _native

# Loads the compiled core alone: the process needs nothing else of the package, and starts in some milliseconds.
_BODY = """\
import importlib.machinery, importlib.util, sys
loader = importlib.machinery.ExtensionFileLoader("opengpac._native", sys.argv[1])
spec = importlib.util.spec_from_file_location("opengpac._native", sys.argv[1], loader=loader)
native = importlib.util.module_from_spec(spec)
loader.exec_module(native)
sys.exit(native.run_processor())
"""


def processes_json() -> dict[str, object]:
    """How processors get processes, as a system is told."""
    return {"command": [sys.executable, "-I", "-S", "-c", _BODY, _native.__file__], "python": sys.executable}
