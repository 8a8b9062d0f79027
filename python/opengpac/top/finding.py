# SPDX-License-Identifier: Apache-2.0
"""Daemons that this user runs: their sockets lie in one folder."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from typing import NamedTuple


class FoundDaemon(NamedTuple):
    """A daemon that answers."""

    name: str
    """The name of its socket, which is that of its system."""
    url: str


def folder() -> Path:
    """Returns the folder of the sockets of this user's daemons, unless they were given another place."""
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    if os.path.isabs(runtime) and os.path.isdir(runtime):
        return Path(runtime) / "opengpac"
    return Path(f"/tmp/opengpac-{os.getuid()}")


def daemons() -> list[FoundDaemon]:
    """Returns those that take a connection now, by name. A socket that a killed daemon has left behind is none."""
    try:
        sockets = sorted(path for path in folder().glob("*.sock") if path.is_socket())
    except OSError:
        return []
    return [FoundDaemon(path.stem, f"unix://{path}") for path in sockets if _answers(path)]


def _answers(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(1.0)
        try:
            connection.connect(str(path))
        except OSError:
            return False
    return True
