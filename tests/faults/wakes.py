# SPDX-License-Identifier: Apache-2.0
"""Lateness of this machine in waking a process that sleeps until the next period: a lower bound for every program on it.

    python tests/faults/wakes.py CORE PERIOD_NS

writes a line `NOW_NS LATE_NS` for each wake-up later than half a period, until it is killed.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

ABSOLUTE = 1  # TIMER_ABSTIME
PRIORITY = 20
"""Priority below every source of the cell, so that these processes disturb none, and above ordinary programs."""

RTTIME_MAX_US = 1_000_000
"""Processor time between two sleeps after which the system ends the process."""


class _Time(ctypes.Structure):
    _fields_ = [("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long)]


def sleep_late(core: int, period_ns: int) -> None:
    """Sleeps from period to period, indefinitely, and writes the lateness of each wake-up that is later than half a period."""
    libc = ctypes.CDLL(None)
    os.sched_setaffinity(0, {core})
    # No process runs at a real-time priority without a limit.
    hard = resource.getrlimit(resource.RLIMIT_RTTIME)[1]
    resource.setrlimit(resource.RLIMIT_RTTIME, (RTTIME_MAX_US if hard < 0 else min(RTTIME_MAX_US, hard), hard))
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    due = time.monotonic_ns() + period_ns
    while True:
        until = _Time(due // 1_000_000_000, due % 1_000_000_000)
        libc.clock_nanosleep(time.CLOCK_MONOTONIC, ABSOLUTE, ctypes.byref(until), None)
        now = time.monotonic_ns()
        if now - due > period_ns // 2:
            print(now, now - due, flush=True)
        due += period_ns * (1 + max(0, now - due) // period_ns)


@contextlib.contextmanager
def measured(period_ns: int, folder: Path) -> Iterator[dict[int, Path]]:
    """Runs such a process on each core for the duration of the block; yields core → file of its lines."""
    files = {core: folder / f"wakes.{core}" for core in sorted(os.sched_getaffinity(0))}
    started = []
    try:
        for core, file in files.items():
            with file.open("w") as out:
                started.append(subprocess.Popen([sys.executable, __file__, str(core), str(period_ns)], stdout=out))
        yield files
    finally:
        for process in started:
            process.kill()
            process.wait()


def misses(files: dict[int, Path]) -> list[tuple[int, int, int]]:
    """Returns the late wake-ups of each core: (core, ns, lateness in ns)."""
    found = []
    for core, file in files.items():
        for line in file.read_text().splitlines():
            words = line.split()
            if len(words) == 2:
                found.append((core, int(words[0]), int(words[1])))
    return found


if __name__ == "__main__":
    sleep_late(int(sys.argv[1]), int(sys.argv[2]))
