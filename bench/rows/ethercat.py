# SPDX-License-Identifier: Apache-2.0
"""EtherCAT on an emulated segment: an exchange beside SOEM's on the same segment, and eight axes at 1 kHz beside cyclictest."""

from __future__ import annotations

import json
import os
import re
import resource
import shutil
import subprocess
import sys
import time as clock
from collections.abc import Iterator
from pathlib import Path

from lines import Line, median, time

import opengpac as gpac
from rows import jitter, kernel

PEER = Path(__file__).resolve().parents[1] / "ethercat_peer.py"
DRIVES = 8
BAR = 1.5
PRIORITY = 80
# What a thread of real-time priority may compute without a rest, µs: one that runs away ends, and not the machine.
RTTIME_US = 5_000_000
EXCHANGE, CYCLES = f"EtherCAT, exchange with {DRIVES} drives", f"EtherCAT, {DRIVES} axes at 1 kHz"


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """The exchange, then the cycle."""
    yield from _exchange(rounds, 500 if quick else 5_000)
    yield from _cycles(2 if quick else 600)


def _exchange(rounds: int, times: int) -> Iterator[Line]:
    if os.geteuid() != 0:
        yield Line("ethercat", EXCHANGE, bar_text=f"≤ {BAR} ×", note="not taken: no right to make a network namespace (run it as root)")
        return
    program = kernel.example("ethercat", "exchange")
    command = ["unshare", "--net", sys.executable, str(PEER), program, str(DRIVES), str(rounds), str(times)]
    measured = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[-1])
    value = median(round_of["ours"] / round_of["peer"] for round_of in measured)
    ours, peer = (median(round_of[of] for round_of in measured) for of in ("ours", "peer"))
    yield Line("ethercat", EXCHANGE, time(ours), f"pysoem {time(peer)}", value, f"{value:.2f} ×", BAR, f"≤ {BAR} ×")


def _cycles(seconds: float) -> Iterator[Line]:
    missing = None
    if shutil.which("cyclictest") is None:
        missing = "cyclictest is missing (apt install rt-tests)"
    elif not jitter.may_run_in_real_time():
        missing = "no right to real-time scheduling (rtprio in limits.conf)"
    peer = None if missing else _cyclictest(seconds)
    ours, lost = _axes(seconds)
    note = f"of {seconds:.0f} s; {lost} answers came late" + (f"; nothing beside it: {missing}" if missing else "")
    value = ours / peer if peer else None
    yield Line(
        "ethercat",
        f"{CYCLES}, greatest lateness",
        time(ours),
        f"cyclictest {time(peer)}" if peer else "",
        value,
        f"{value:.2f} ×" if value else "",
        note=note,
    )


def _axes(seconds: float) -> tuple[float, int]:
    """The greatest lateness of a source with all axes in its cycle, ns, and how many answers were not there a period later."""
    resource.setrlimit(resource.RLIMIT_RTTIME, (RTTIME_US, resource.getrlimit(resource.RLIMIT_RTTIME)[1]))
    names = [f"a{number}" for number in range(DRIVES)]
    with (
        gpac.drivers.fake.ethercat(*({"name": name, "watchdog": False} for name in names)) as segment,
        gpac.System("bench", progress=False) as cell,
    ):
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=PRIORITY)
        axes = {name: {"counts": 10_000} for name in names}
        # It ends where nothing comes for a minute, and not where this machine is busy.
        driver = gpac.drivers.ethercat(segment.interface, axes, lost_after=60_000)
        line = rtp.physical_device("line", driver, exchange=fast)
        end = clock.monotonic() + seconds
        while clock.monotonic() < end:
            clock.sleep(min(1.0, seconds))
        source = next(iter(cell.statistics["sources"].values()))
        return source["jitter_max_ns"], line.counters["frames_lost"]


def _cyclictest(seconds: float) -> float:
    """Its greatest latency, ns."""
    command = ["cyclictest", "-q", "-m", "-t", "1", "-p", str(PRIORITY), "-i", "1000", "-l", str(int(seconds * 1000))]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    found = re.search(r"Max:\s*(\d+)", said)
    if found is None:
        raise RuntimeError(f"cyclictest says nothing of its greatest latency: {said}")
    return float(found[1]) * 1e3
