# SPDX-License-Identifier: Apache-2.0
"""Handover of a device between programs: the driver process of a killed program still brings the outputs to their safe state, and the
next driver process waits for it to finish.

A process claims a device by binding a socket in the abstract namespace, which disappears when the process exits for any reason.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

is_process = False
"""True in a driver process. False under virtual time, when the class runs in the process of the program."""

PATIENCE_S = 10.0
"""Time within which an orphaned process must reach its safe state and close the device."""


def taken_over(device: str, patience_s: float = PATIENCE_S) -> socket.socket:
    """Claims a device for this process and returns the claim, valid until it is closed. First waits for processes that a killed program
    left behind.

    `device` identifies the device by its driver and options. Two running programs may both claim it: the device itself must reject
    the second. Raises `TimeoutError`, which names the process, if an orphaned process does not end within `patience_s`.
    """
    names = f"opengpac-driver-{os.getuid()}-{hashlib.sha256(device.encode()).hexdigest()[:16]}-"
    for name in _others(names):
        _wait_for(name, patience_s)
    sign = socket.socket(socket.AF_UNIX)
    # The name is unpredictable, so that no process can bind it first.
    sign.bind(f"\0{names}{secrets.token_hex(8)}-{os.getpid()}-{os.getppid()}")
    sign.listen()
    return sign


def _others(names: str) -> Iterator[str]:
    """Yields the claims of other processes on the same device."""
    for line in Path("/proc/net/unix").read_text().splitlines():
        name = line.rpartition(" ")[2]
        if name.startswith(f"@{names}"):
            yield name[1:]


def _wait_for(name: str, patience_s: float) -> None:
    """Waits until the process with this claim has ended; returns immediately if its program is still running."""
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(patience_s)
        with suppress(ConnectionError):
            line.connect(f"\0{name}")
            # The number in this namespace: 0 for a process of another container.
            pid, uid, _ = struct.unpack("3i", line.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
            # Any user can bind any name: another user's process could only delay this one.
            if uid != os.getuid() or not _is_left(pid, program=int(name.rpartition("-")[2])):
                return
            try:
                line.recv(1)
            except TimeoutError:
                remedy = f"wait until its outputs are safe, or terminate it (kill -9 {pid})"
                raise TimeoutError(f"process {pid} of a killed program still holds the device; {remedy}") from None


def _is_left(pid: int, program: int) -> bool:
    """Returns whether a process is running whose parent program has exited."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return int(stat.rpartition(")")[2].split()[1]) != program
