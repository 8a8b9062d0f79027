# SPDX-License-Identifier: Apache-2.0
"""MJCF files of third-party arms: corrects defects that prevent an arm from moving, each with a note.

A separate process checks a file (`survey`), because some files crash MuJoCo. A file that MuJoCo cannot read is left unchanged, and
the driver reports the error. Malformed XML is reported here, because MuJoCo gives the line at which the enclosing element begins.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from ...errors import DeviceFailed, refuse
from .. import plausible
from ..urdf.source import Source, check_xml, parsed

_SURVEY = Path(__file__).parent / "survey.py"
WAIT_S = 600.0
"""Time limit of one survey on a busy machine, s; its processor time has a separate limit (`survey.SECONDS_MAX`)."""


def put_right(file: Path, is_whole: bool = False) -> tuple[str | None, tuple[str, ...], frozenset[str]]:
    """Returns the model to simulate instead of a file, or None if the file is used unchanged; the notes on the changes; and the joints
    with dry friction or mimic joints. With `is_whole` it always returns the model. Raises `DeviceFailed` for a file that is not XML,
    or that contains a number that is impossible for a joint or body."""
    try:
        command = [sys.executable, _SURVEY, file, *(["--whole"] if is_whole else [])]
        run = subprocess.run(command, capture_output=True, timeout=WAIT_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None, (), frozenset()
    lines = run.stdout.splitlines()
    if run.returncode != 0 or not lines:
        check_xml(file, "MJCF or URDF")
        return None, (), frozenset()
    found = json.loads(lines[-1])
    if isinstance(found, str):
        refuse(DeviceFailed, f"{file}: {found}", "fix it in the file")
    text, notes, held_back = found
    return text, tuple(f"{file.name}: {note}" for note in notes), frozenset(held_back)


def check_numbers(file: Path) -> None:
    """Refuses an MJCF file if it, or a file that it includes, contains an impossible number. Malformed XML is left to MuJoCo to report."""
    seen: set[Path] = set()
    waiting = [file]
    while waiting:
        found = _elements(one := waiting.pop())
        seen.add(one)
        if found is None:
            continue
        plausible.check_mjcf(found)
        included = [include.get("file", "") for include in found.root.iter("include")]
        # Older versions of MuJoCo search next to the whole file, newer ones next to the including file.
        waiting += {folder / name for name in included for folder in (file.parent, one.parent)} - seen


def _elements(file: Path) -> Source | None:
    """Returns the elements of a file, or None if it does not exist or is not XML."""
    try:
        return parsed(file, file.read_bytes(), "MJCF or URDF")
    except (OSError, DeviceFailed):
        return None
