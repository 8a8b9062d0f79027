# SPDX-License-Identifier: Apache-2.0
"""Xacro macros in robot files: finds them, and expands them in a separate process."""

from __future__ import annotations

import importlib.util
import re
import signal
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree

from ...errors import DeviceFailed, refuse
from .packages import Packages

_EXPAND = Path(__file__).with_name("expand.py")
SECONDS_MAX = 60
"""Maximum processor time of one expansion, s."""
WAIT_S = 600.0
"""Time limit of one expansion, in case the machine is busy or the expansion blocks, s."""
_REFUSED = 3
"""Exit code of the program for a file that cannot be expanded."""


def first(elements: Iterable[ElementTree.Element]) -> ElementTree.Element | None:
    """Returns the first element that is a macro, or has one in an attribute."""
    return next((element for element in elements if _is_macro(element)), None)


def _is_macro(element: ElementTree.Element) -> bool:
    return element.tag.startswith("xacro:") or any("${" in value or "$(" in value for value in element.attrib.values())


def expanded(file: Path, packages: Packages, line: int) -> bytes:
    """Returns the expanded XML of a file whose first macro is on `line`. Raises `DeviceFailed` if it cannot be expanded."""
    if importlib.util.find_spec("xacro") is None:
        missing = f"'{file}' contains xacro macros, the first of them on line {line}, but xacro is not installed"
        refuse(DeviceFailed, missing, "run pip install xacro, or expand the file first: xacro FILE > arm.urdf")
    command = [sys.executable, "-P", _EXPAND, str(SECONDS_MAX), file, *packages.roots]
    try:
        run = subprocess.run(command, capture_output=True, timeout=WAIT_S, check=False)
        if run.returncode == 0:
            return run.stdout
        if run.returncode == -signal.SIGXCPU:
            raise subprocess.TimeoutExpired(command, SECONDS_MAX)
        why = run.stdout.decode() if run.returncode == _REFUSED else f"its process exited with status {run.returncode}"
    except subprocess.TimeoutExpired as error:
        why = f"it takes more than {error.timeout:g} s"
    except OSError as error:
        why = str(error)
    place = f"the first macro is on line {line}{_lines_of_expression(file, why)}"
    refuse(DeviceFailed, f"xacro cannot expand '{file}': {why}; {place}", "run it in a terminal: xacro FILE")


def _lines_of_expression(file: Path, why: str) -> str:
    """Returns the location in a file of the expression that an xacro message quotes without a line number; empty if it quotes none."""
    found = re.search(r"evaluating expression '([^']+)'|substitution argument (\S+)", why)
    if found is None:
        return ""
    written = "${" + found[1] + "}" if found[1] else f"$(arg {found[2]})"
    lines = [str(number) for number, line in enumerate(file.read_bytes().decode("latin-1").splitlines(), 1) if written in line]
    return f", '{written}' is on line {' and '.join(lines[:3])}" if lines else ""
