# SPDX-License-Identifier: Apache-2.0
"""Prints a file with its xacro macros expanded; on failure prints the reason and exits with code 3.

Runs as a program, `python -P expand.py SECONDS FILE ROOT…`, in a separate process, because macros may run endlessly. Imports nothing
from OpenGPAC except the module next to it. `$(find PACKAGE)` is searched for in the roots, like `package://PACKAGE`; ROS need not be
installed.
"""

from __future__ import annotations

import importlib.util
import resource
import sys
import types
from pathlib import Path
from typing import Any

REFUSED = 3
"""Exit code if the file cannot be expanded."""
BYTES_MAX = 2 << 30
"""Maximum memory of an expansion, bytes."""


def main(file: str, roots: list[str]) -> int:
    """Prints the expanded file or the reason why it cannot be expanded, and returns the exit code."""
    xacro: Any = importlib.import_module("xacro")
    _answer_find(_packages().Packages(Path(file), map(Path, roots)))
    try:
        text = xacro.process_file(file).toxml()
    except Exception as error:  # xacro raises a dozen kinds
        sys.stdout.write(_sentence(error, file, xacro.filestack or []))
        return REFUSED
    sys.stdout.buffer.write(text.encode())
    return 0


def _answer_find(packages: Any) -> None:
    """Makes xacro search for packages in the folders in which the meshes of a URDF file are searched for, by replacing the ROS module
    that it queries."""

    def get_package_share_directory(name: str) -> str:
        if (folder := packages.folder(name)) is None:
            raise LookupError(f"package '{name}' was not found; specify where packages are with package_paths=")
        return str(folder)

    module = types.ModuleType("ament_index_python.packages")
    vars(module)["get_package_share_directory"] = get_package_share_directory
    sys.modules.update({"ament_index_python": types.ModuleType("ament_index_python"), module.__name__: module})


def _packages() -> Any:
    """Loads the module `packages` next to this one. Its folder is not on the path, because its modules would shadow Python's own."""
    spec = importlib.util.spec_from_file_location("packages", Path(__file__).with_name("packages.py"))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _sentence(error: Exception, file: str, stack: list[str | None]) -> str:
    """Formats the message of an error on one line, with the included file in which it occurred."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    cause = getattr(error, "exc", None) or error
    if not str(cause):
        lines.insert(0, type(cause).__name__)
    inner = next((name for name in reversed(stack) if name), file)
    return "; ".join(lines) + (f", in '{inner}'" if inner != file else "")


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (BYTES_MAX, BYTES_MAX))
    resource.setrlimit(resource.RLIMIT_CPU, (int(sys.argv[1]), int(sys.argv[1]) + 1))
    sys.exit(main(sys.argv[2], sys.argv[3:]))
