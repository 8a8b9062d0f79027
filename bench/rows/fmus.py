# SPDX-License-Identifier: Apache-2.0
"""A step of an imported FMU: its block's entry compared with the FMU's own functions, both called from C in turns."""

from __future__ import annotations

import importlib
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from lines import Line, median, time

import opengpac as gpac

ROOT = Path(__file__).parents[2]
BAR_NS = 1000.0


def measure(rounds: int) -> Iterator[Line]:
    """Yields one line: the overhead of the block over the FMU itself."""
    # FMU of the tests, with the headers that fmpy provides.
    sys.path.insert(0, str(ROOT / "tests" / "python"))
    try:
        making = importlib.import_module("fmi.making")
    finally:
        sys.path.pop(0)
    with tempfile.TemporaryDirectory() as folder:
        block = gpac.fmu(making.lag(Path(folder) / "lag.fmu", 2)).module
        own, loop = Path(folder) / "lag.so", f"{folder}/fmu_step"
        own.write_bytes(making.library(2))
        header = ROOT / "crates" / "block" / "include"
        subprocess.run(["cc", "-O2", "-I", header, ROOT / "bench" / "c" / "fmu_step.c", "-o", loop, "-ldl"], check=True)
        told = subprocess.run([loop, str(200 * rounds), block, own], check=True, capture_output=True, text=True).stdout
    pairs = [(float(a), float(b)) for a, b in (line.split() for line in told.splitlines())]
    ours, theirs, more = (median(values) for values in (*zip(*pairs, strict=True), [a - b for a, b in pairs]))
    yield Line("fmu", "a step of an imported FMU (FMI 2, 7 variables), beside its own functions", time(ours), f"FMU: {time(theirs)}", more,
        f"{time(more)} more", BAR_NS, f"≤ {time(BAR_NS)} more",
        note=f"of {len(pairs):,} rounds of 2,000 steps in turns; the same values")  # fmt: skip
