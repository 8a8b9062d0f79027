# SPDX-License-Identifier: Apache-2.0
"""A PID as a block in Python, compared with the same in C: its entry called in a bare loop, and the compilation time of the first block."""

from __future__ import annotations

import importlib
import os
import resource
import subprocess
import tempfile
import time as clock
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated as A

from lines import Line, median, time

import opengpac as gpac
from opengpac import _native
from opengpac.python import Input, Output, Parameter, State

C = Path(__file__).parent.parent / "c"
BAR_NS, RATIO, COMPILED_NS = 25.0, 1.1, 1e9


def pid(
    setpoint: A[float, Input("where it is to be", "rad")],
    measured: A[float, Input("where it is", "rad")],
    effort: A[float, Output("effort", "N.m")],
    integral: A[float, State("integral")] = 0.0,
    filtered: A[float, State("filtered derivative")] = 0.0,
    before: A[float, State("measured before")] = 0.0,
    kp: A[float, Parameter("gain")] = 60.0,
    ki: A[float, Parameter("gain of the integral")] = 5.0,
    kd: A[float, Parameter("gain of the derivative")] = 1.0,
    alpha: A[float, Parameter("smoothing factor")] = 0.2,
    limit: A[float, Parameter("limit", "N.m")] = 100.0,
    dt: A[float, Parameter("period", "s")] = 0.001,
):
    """PID with a filtered derivative, limits and anti-windup."""
    error = setpoint - measured
    filtered += alpha * ((before - measured) / dt - filtered)
    before = measured
    raw = kp * error + integral + kd * filtered
    effort = max(-limit, min(limit, raw))
    if effort == raw or (raw > effort) != (error > 0.0):
        integral += ki * error * dt
    return effort, integral, filtered, before


def measure(rounds: int) -> Iterator[Line]:
    """Yields three lines: one call, the same in C, the first block of a process."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["OPENGPAC_COMPILED"] = folder
        importlib.import_module("numba")
        begun = _processor_time_s()
        started = clock.perf_counter()
        ours = gpac.block(pid).module
        took, used = clock.perf_counter() - started, _processor_time_s() - begun
        theirs, loop = f"{folder}/pid_in_c.so", f"{folder}/entry"
        _native.build([str(C / "pid.c")], theirs)
        header = Path(__file__).parents[2] / "crates" / "block" / "include"
        subprocess.run(["cc", "-O2", "-I", header, C / "entry.c", "-o", loop, "-ldl"], check=True)
        told = subprocess.run([loop, str(2000 * rounds), ours, theirs], check=True, capture_output=True, text=True).stdout
    pairs = [(float(a), float(b)) for a, b in (line.split() for line in told.splitlines())]
    a, b, ratio = median(a for a, _ in pairs), median(b for _, b in pairs), median(a / b for a, b in pairs)
    yield Line("python blocks", "PID in Python, one call", time(a), value=a, shown=time(a), bar=BAR_NS, bar_text=f"≤ {BAR_NS:.0f} ns")
    fastest = f"the fastest {time(min(pairs)[0])}, C {time(min(b for _, b in pairs))}"
    yield Line("python blocks", "the same, beside C", time(a), f"C: {time(b)}", ratio, f"{ratio:.2f} ×", RATIO, f"≤ {RATIO} ×",
        note=f"of {len(pairs):,} rounds of 2,000 calls in turns; {fastest}")  # fmt: skip
    yield Line("python blocks", "the first block of a process, processor time to compile it", time(used * 1e9), value=used * 1e9,
        shown=time(used * 1e9), bar=COMPILED_NS, bar_text="≤ 1 s",
        note=f"numba loaded before, the compiler of C included; {took:.2f} s by the clock")  # fmt: skip


def _processor_time_s() -> float:
    """Returns the processor time of this process and of the compilers that it has run."""
    return clock.process_time() + sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
