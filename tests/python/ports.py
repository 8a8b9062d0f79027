# SPDX-License-Identifier: Apache-2.0
"""Ports of this machine for servers of tests, protected from other programs meanwhile."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator


def hold_port(host: str = "127.0.0.1") -> socket.socket:
    """Returns a socket that reserves a free port until it is closed. It does not listen: a server that allows the reuse of addresses
    can."""
    held = socket.socket()
    held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    held.bind((host, 0))
    return held


@contextlib.contextmanager
def held_port() -> Iterator[int]:
    """Yields a free port of the loopback address, reserved meanwhile."""
    with hold_port() as held:
        yield held.getsockname()[1]
