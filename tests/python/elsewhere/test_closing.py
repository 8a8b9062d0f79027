# SPDX-License-Identifier: Apache-2.0
"""A system with processes, closed or killed, leaves nothing behind; and its plants receive safe commands."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import opengpac as gpac
from afar import Afar, children, shared_memory, until
from opengpac import _native

pytestmark = pytest.mark.alone

KILLED = """
import sys
import opengpac as gpac
from afar import Afar, Guarded, children, pushing, until
cell = gpac.System("killed", progress=False)
afar = Afar(cell, {})
driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=sys.argv[1])
drives = afar.rtp1.physical_device("drives", driver, exchange=afar.there)
pushing.on(afar.there).asynch(drives["x"].effort, u=1.0)
print(*children("run_processor"), *children("run_guard"), flush=True)
sys.stdin.read()
"""


def gone(pid: int) -> Callable[[], bool]:
    """Returns a check whether a process has ended, even if its exit status has not been collected yet."""

    def ended() -> bool:
        try:
            return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] in "ZX"
        except OSError:
            return True

    return ended


def is_safe(plant: str) -> bool:
    """Returns whether the plant receives only safe commands."""
    text = _native.plant_state(plant)
    return text is None or json.loads(text)["is_safe"]


def test_close_leaves_no_process_and_no_shared_memory(built: dict[str, str]) -> None:
    with gpac.System("nothing_left", progress=False) as cell:
        afar = Afar(cell, built)
        beside = cell.processor("rtp2", process=True).timer("fast", period="2 ms", priority=80)
        for number, source in enumerate((afar.here, afar.there, beside)):
            afar.counting().on(source).asynch(cell.svv(f"y{number}"))
        processes = children("run_processor")
        assert len(processes) == 2
        assert shared_memory("nothing_left")
    for process in processes:
        until(gone(process), "the processes have ended")
    until(lambda: not children("run_processor") and not children("run_guard"), "no child is left")
    assert shared_memory("nothing_left") == []


@pytest.mark.parametrize("process", [True, "cell-a"])
def test_close_ends_the_process_of_a_processor_without_a_source(process: bool | str) -> None:
    with gpac.System("nothing_there", progress=False) as cell:
        cell.processor("rtp1", process=process)
        [pid] = children("run_processor")
    assert gone(pid)(), "it has ended when the system is closed"


def test_close_ends_a_process_that_does_not_answer(built: dict[str, str]) -> None:
    with gpac.System("does_not_answer", progress=False) as cell:
        afar = Afar(cell, built)
        afar.counting().on(afar.there).asynch(cell.svv("y"))
        process = afar.process()
        afar.end(signal.SIGSTOP)
    until(gone(process), "the process has ended")
    until(lambda: not children("run_processor") and not children("run_guard"), "no child is left")
    until(lambda: shared_memory("does_not_answer") == [], "no name is left")


def test_the_processes_of_a_killed_system_end_and_its_plant_is_safe() -> None:
    name = f"killed-{os.getpid()}"
    paths = os.pathsep.join([str(Path(__file__).parent.parent), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-W", "ignore", "-c", KILLED, name]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": paths}
    ) as run:
        assert run.stdout
        processes = [int(word) for word in run.stdout.readline().split()]
        assert len(processes) == 3, "a processor and the two of its guard"

        until(lambda: not is_safe(name), "the plant is pushed")
        run.kill()
        run.wait()
    until(lambda: is_safe(name), "the plant is safe, or put away")
    for process in processes:
        until(gone(process), "its processes have ended")
    until(lambda: shared_memory("killed") == [], "no name is left")
