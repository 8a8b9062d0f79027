# SPDX-License-Identifier: Apache-2.0
"""MJCF files of other people's arms: what keeps an arm from moving is put right, each with a note.

A process of its own looks a file over (`survey`), for MuJoCo does not survive every file. A file that it cannot read is left as it is: the
driver says what is wrong with it, but for XML that is none: MuJoCo names the line at which the element around the fault begins.
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
SECONDS_MAX = 60.0
"""Time that one survey may take."""


def put_right(file: Path, is_whole: bool = False) -> tuple[str | None, tuple[str, ...], frozenset[str]]:
    """Returns the model to simulate in place of a file, or nothing where the file is used as it is, the notes on what was
    changed, and the joints that dry friction or followers hold back. With `is_whole` the model is returned in any case. Raises
    `DeviceFailed` for a file that is not XML, and for one with a number that no joint or body can have."""
    try:
        command = [sys.executable, _SURVEY, file, *(["--whole"] if is_whole else [])]
        run = subprocess.run(command, capture_output=True, timeout=SECONDS_MAX, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None, (), frozenset()
    lines = run.stdout.splitlines()
    if run.returncode != 0 or not lines:
        check_xml(file, "MJCF or URDF")
        return None, (), frozenset()
    found = json.loads(lines[-1])
    if isinstance(found, str):
        refuse(DeviceFailed, f"{file}: {found}", "mend it in the file")
    text, notes, held_back = found
    return text, tuple(f"{file.name}: {note}" for note in notes), frozenset(held_back)


def check_numbers(file: Path) -> None:
    """Refuses an MJCF file, or one that it includes, for a number that nothing can have; one that is no XML is left to its reader."""
    seen: set[Path] = set()
    waiting = [file]
    while waiting:
        found = _elements(one := waiting.pop())
        seen.add(one)
        if found is None:
            continue
        plausible.check_mjcf(found)
        included = [include.get("file", "") for include in found.root.iter("include")]
        # Older versions of MuJoCo look beside the whole file, newer ones beside the file that includes.
        waiting += {folder / name for name in included for folder in (file.parent, one.parent)} - seen


def _elements(file: Path) -> Source | None:
    """Returns the elements of a file, nothing where it is not there or no XML."""
    try:
        return parsed(file, file.read_bytes(), "MJCF or URDF")
    except (OSError, DeviceFailed):
        return None
