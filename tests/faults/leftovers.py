# SPDX-License-Identifier: Apache-2.0
"""Leftovers that a fault must not leave behind: processes, and names in shared memory."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

MARK = "OPENGPAC_FAULT_CAMPAIGN"
"""Environment variable that every process of a campaign inherits."""

ALONE = "OPENGPAC_FAULT_CAMPAIGN_ALONE"
"""Environment variable that is set if the campaign has its own shared memory folder and process numbers."""

_ALONE_SCRIPT = 'mount -t tmpfs tmpfs /dev/shm && "$@"; exit $?'


def enter_alone(program: list[str]) -> None:
    """Runs the program again in its own namespaces, if the system permits them; returns if it does not, or if the program already runs
    in them."""
    if os.environ.get(ALONE):
        return
    unshare = ["unshare", "--mount", "--pid", "--ipc", "--fork", "--kill-child", "--mount-proc"]
    if os.geteuid() != 0:
        unshare.insert(1, "--map-root-user")
    try:
        given = subprocess.run([*unshare, "bash", "-c", _ALONE_SCRIPT, "bash", "true"], capture_output=True).returncode == 0
    except FileNotFoundError:
        given = False
    if given:
        os.environ[ALONE] = "1"
        # Ctrl-C is for the inner program, which reports its results so far.
        signal.signal(signal.SIGINT, lambda *_: None)
        sys.exit(subprocess.run([*unshare, "bash", "-c", _ALONE_SCRIPT, "bash", sys.executable, *program]).returncode)


def processes() -> set[int]:
    """Returns the processes of this campaign, except this one."""
    mark = f"{MARK}={os.environ.setdefault(MARK, str(os.getpid()))}".encode()
    found = set()
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            try:
                if mark in (entry / "environ").read_bytes().split(b"\0"):
                    found.add(int(entry.name))
            except OSError:
                continue
    return found


def shared_memory() -> set[str]:
    """Returns the names in shared memory."""
    return {str(path) for path in Path("/dev/shm").rglob("*")}


class Before:
    """Processes and shared memory before a fault."""

    def __init__(self) -> None:
        self._processes, self._shared_memory = processes(), shared_memory()

    def new(self) -> set[int]:
        """Returns the processes that have been started since."""
        return processes() - self._processes

    def left_over(self, within_s: float = 10.0) -> list[str]:
        """Returns descriptions of the leftovers, once they no longer shrink or `within_s` has passed."""
        end = time.monotonic() + within_s
        while True:
            new = self.new()
            left = [f"process {pid} ({command_of(pid)[:120]})" for pid in sorted(new)]
            left += [f"shared memory {name}" for name in sorted(shared_memory() - self._shared_memory)]
            if not left or time.monotonic() > end:
                return left
            _until_one_ends(new, 0.05)


def _until_one_ends(pids: set[int], limit_s: float) -> None:
    descriptors = []
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            descriptors.append(os.pidfd_open(pid))
    try:
        select.select(descriptors, [], [], limit_s)
    finally:
        for descriptor in descriptors:
            os.close(descriptor)


def command_of(pid: int) -> str:
    """Returns the beginning of a process's command line."""
    try:
        return (Path("/proc") / str(pid) / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return "gone"
