# SPDX-License-Identifier: Apache-2.0
"""EtherCAT on an emulated segment: an exchange compared with SOEM's, and eight axes at 1 kHz compared with cyclictest, in one run of
`ethercat_cycles.py`."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lines import Line, time

PROGRAM = Path(__file__).resolve().parents[1] / "ethercat_cycles.py"
DRIVES = 8
BAR = 1.5
EXCHANGE, CYCLES = f"EtherCAT, exchange with {DRIVES} drives", f"EtherCAT, {DRIVES} axes at 1 kHz"


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """Yields the exchange, then the cycles."""
    minutes, times = (2 / 60, 500) if quick else (10.0, 5_000)
    command = [sys.executable, str(PROGRAM), "--json", "--minutes", str(minutes), "--rounds", str(rounds), "--times", str(times)]
    found = json.loads(subprocess.run(command, check=False, stdout=subprocess.PIPE, text=True).stdout.splitlines()[-1])
    yield _exchange(found)
    yield from _cycles(found)


def _exchange(found: dict[str, Any]) -> Line:
    if found["peer"] is None:
        note = "not taken: no right to make a network namespace (run it as root)"
        return Line("ethercat", EXCHANGE, bar_text=f"≤ {BAR} ×", note=note)
    value = found["ours"] / found["peer"]
    return Line("ethercat", EXCHANGE, time(found["ours"]), f"pysoem {time(found['peer'])}", value, f"{value:.2f} ×", BAR, f"≤ {BAR} ×")


def _cycles(found: dict[str, Any]) -> Iterator[Line]:
    beside, ours, lost = found["cyclictest"], found["lateness"]["maximum"], found["counters"]["frames_lost"]
    note = f"of {found['cycles']} cycles; {lost} answers came late"
    note += "" if beside else f"; nothing beside it: {found['missing']}"
    peer = f"cyclictest {time(beside['maximum'])}" if beside else ""
    value = ours / beside["maximum"] if beside else None
    yield Line("ethercat", f"{CYCLES}, maximum lateness", time(ours), peer, value, f"{value:.2f} ×" if value else "", note=note)
    allocations = found["allocations"]
    yield Line("ethercat", f"{CYCLES}, allocations in the cycles", str(allocations), "", allocations, str(allocations), 0, "0")
