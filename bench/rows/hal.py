# SPDX-License-Identifier: Apache-2.0
"""LinuxCNC HAL compared with dispatch, if it is installed (Debian's `linuxcnc-uspace`): 500 `sum2` in a chain in one thread of 1 ms, by
the time that the thread itself reports. HAL counts processor ticks, so these are measured here too."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import tempfile
import time as clock
from collections.abc import Iterator
from pathlib import Path

from lines import Line, median, time

from rows import kernel

COUNT = 500
ROW = "hal"
NOBODY = "65534"
WHAT = f"{COUNT} sum2 in a chain, LinuxCNC HAL"
TICKS = "unsigned long long ticks(void) { return __builtin_ia32_rdtsc(); }\n"


def measure(quick: bool) -> Iterator[Line]:
    """Yields HAL's own time of its thread per function, ns, or the reason why there is none. The row of ours is `gain in C, chain` of
    dispatch."""
    if shutil.which("halrun") is None:
        yield Line(ROW, WHAT, note="not taken: LinuxCNC HAL is not installed (apt install linuxcnc-uspace)")
        return
    try:
        looks = _looks(20 if quick else 200)
        each = median(looks) / _ticks_per_ns() / COUNT
    except (OSError, RuntimeError, subprocess.SubprocessError) as error:
        yield Line(ROW, WHAT, note=f"not taken: HAL did not run: {' '.join(str(error).split())[:120]}")
        return
    ours = next((line for line in kernel.measure("dispatch", 2) if line.what.startswith("gain in C, chain, 1,000")), None)
    beside = float(ours.ours.split()[0]) if ours is not None and ours.ours.split()[1] == "ns" else None
    shown = f"{beside / each:.2f} ×" if beside else ""
    yield Line(ROW, WHAT, ours.ours if ours else "", f"HAL {time(each)} a function", beside and beside / each, shown, 1.0, "≤ 1 ×")


def _looks(times: int) -> list[float]:
    """Returns the durations of `times` firings of the thread, in ticks."""
    nets = [f"net s{at} sum2.{at}.out sum2.{at + 1}.in0" for at in range(COUNT - 1)]
    calls = [f"addf sum2.{at} bench" for at in range(COUNT)]
    setup = ["loadrt threads name1=bench period1=1000000", f"loadrt sum2 count={COUNT}", *nets, *calls, "start", "loadusr -w sleep 1"]
    # A pin in newer versions, a parameter in older ones; a missing one is reported on standard error only.
    look = ["getp bench.time", "loadusr -w sleep 0.005"]
    with tempfile.TemporaryDirectory() as folder:
        # As root HAL must be given a user id, and that user must be able to reach its socket.
        os.chmod(folder, 0o777)
        env = {**os.environ, "RTAPI_FIFO_PATH": f"{folder}/fifo", **({"RTAPI_UID": NOBODY} if os.geteuid() == 0 else {})}
        script = Path(folder) / "bench.hal"
        script.write_text("\n".join([*setup, *look * times, "stop", "unload all"]) + "\n")
        done = subprocess.run(["halrun", "-f", str(script)], capture_output=True, text=True, timeout=120, env=env)
    found = [float(text) for text in re.findall(r"^\s*(\d+)\s*$", done.stdout, re.MULTILINE)]
    if not found:
        raise RuntimeError(done.stderr or "it told no times")
    return found


def _ticks_per_ns() -> float:
    """Returns the ticks of the processor's counter per nanosecond."""
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder) / "ticks.c", Path(folder) / "ticks.so"
        source.write_text(TICKS)
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", source, "-o", library], check=True)
        ticks = ctypes.CDLL(str(library)).ticks
    ticks.restype = ctypes.c_ulonglong
    first, began = ticks(), clock.perf_counter_ns()
    clock.sleep(0.2)
    return (ticks() - first) / (clock.perf_counter_ns() - began)
