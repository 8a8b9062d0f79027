# SPDX-License-Identifier: Apache-2.0
"""`opengpac join` for tests: a real process that lends its host, and its output."""

from __future__ import annotations

import contextlib
import signal
import socket
import subprocess
import sys

from daemons import PATIENCE_S, environment
from ports import hold_port

LISTENER = "cell-a"
"""Name of the listening host."""


_held: list[socket.socket] = []
"""Ports that were assigned; no other program gets them while this one runs."""


def free_endpoint(scheme: str = "tcp", host: str = "127.0.0.1") -> str:
    """Returns an endpoint of this machine whose port no other program has or gets."""
    _held.append(hold_port())
    return f"{scheme}/{host}:{_held[-1].getsockname()[1]}"


class Joining:
    """Host that joins a system: a process that ends with the system, or with the test."""

    def __init__(self, system: str, endpoint: str, name: str = "cell-b", *options: str) -> None:
        words = ["join", "--system", system, "--at", endpoint, "--name", name, *options]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "opengpac", *words],
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def first_line(self) -> str:
        """Returns the first line of the output, printed before the host joins."""
        assert self.process.stdout is not None
        return self.process.stdout.readline()

    def ended(self) -> tuple[int, str]:
        """Waits for the process to end by itself; returns its status and output."""
        try:
            said, _ = self.process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.kill()
            raise
        return self.process.returncode, said

    def interrupt(self) -> None:
        """Sends Ctrl-C."""
        self.process.send_signal(signal.SIGINT)

    def kill(self) -> None:
        """Kills the host, as a power failure would."""
        with contextlib.suppress(ProcessLookupError):
            self.process.kill()
        self.process.communicate(timeout=PATIENCE_S)
