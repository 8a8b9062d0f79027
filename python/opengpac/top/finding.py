# SPDX-License-Identifier: Apache-2.0
"""Finds the daemons of this user, whose sockets are in one folder."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from typing import NamedTuple


class FoundDaemon(NamedTuple):
    """A daemon that answers."""

    name: str
    """Name of the daemon's socket, which is the name of its system."""
    url: str


def folder() -> Path:
    """Returns the folder of the sockets of this user's daemons, if no other path was set for them."""
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    if os.path.isabs(runtime) and os.path.isdir(runtime):
        return Path(runtime) / "opengpac"
    return Path(f"/tmp/opengpac-{os.getuid()}")


def daemons() -> list[FoundDaemon]:
    """Returns the daemons that currently accept a connection, by name. Stale sockets of killed daemons are ignored."""
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
