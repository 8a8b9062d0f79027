# SPDX-License-Identifier: Apache-2.0
"""Temporary folders of a process."""

from __future__ import annotations

import atexit
import functools
import os
import shutil
import tempfile
from pathlib import Path


def process_folder(purpose: str) -> Path:
    """Returns the folder of this process for `purpose`, which is removed when the process exits. A forked child uses its own folder, and
    does not touch its parent's."""
    return _made(purpose, os.getpid())


@functools.cache
def _made(purpose: str, process: int) -> Path:
    folder = Path(tempfile.mkdtemp(prefix=f"opengpac-{purpose}-"))
    atexit.register(_remove, folder, process)
    return folder


def _remove(folder: Path, process: int) -> None:
    # A forked child inherits the exit functions.
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)
