# SPDX-License-Identifier: Apache-2.0
"""The process of a driver whose program was killed still brings its outputs to their safe state: the next one for that device waits for it.

A process says that it has a device by a socket in the abstract namespace, which goes with the process whatever ends it.
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
"""Whether this is the process of a driver: else time is virtual, and its class is in the process of the program."""

PATIENCE_S = 10.0
"""How long a process that was left behind may take to bring its safe state and to close the device."""


def taken_over(device: str, patience_s: float = PATIENCE_S) -> socket.socket:
    """Returns the sign that this process has a device, until it is closed; waits first for processes that a killed program left with it.

    `device` is what tells it from others: a driver and its options. Two programs that live may have it at a time: that is for the device
    to refuse. Raises `TimeoutError`, with the process, where one that was left behind does not end.
    """
    names = f"opengpac-driver-{os.getuid()}-{hashlib.sha256(device.encode()).hexdigest()[:16]}-"
    for name in _others(names):
        _wait_for(name, patience_s)
    sign = socket.socket(socket.AF_UNIX)
    # A name that nobody can foresee, and so bind before.
    sign.bind(f"\0{names}{secrets.token_hex(8)}-{os.getpid()}-{os.getppid()}")
    sign.listen()
    return sign


def _others(names: str) -> Iterator[str]:
    """The signs of other processes for the same device."""
    for line in Path("/proc/net/unix").read_text().splitlines():
        name = line.rpartition(" ")[2]
        if name.startswith(f"@{names}"):
            yield name[1:]


def _wait_for(name: str, patience_s: float) -> None:
    """Returns when the process with this sign has ended, at once where its program lives."""
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(patience_s)
        with suppress(ConnectionError):
            line.connect(f"\0{name}")
            # As it is numbered here: 0 for one of another container.
            pid, uid, _ = struct.unpack("3i", line.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
            # Any user can bind any name: another user's process could only hold this one up.
            if uid != os.getuid() or not _is_left(pid, program=int(name.rpartition("-")[2])):
                return
            try:
                line.recv(1)
            except TimeoutError:
                remedy = f"wait until it has made its outputs safe, or end it (kill -9 {pid})"
                raise TimeoutError(f"process {pid}, which a killed program left behind, still has the device; {remedy}") from None


def _is_left(pid: int, program: int) -> bool:
    """Returns whether a process lives, and the program that started it does not."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return int(stat.rpartition(")")[2].split()[1]) != program
