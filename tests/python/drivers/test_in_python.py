# SPDX-License-Identifier: Apache-2.0
"""A driver in Python in a process of its own: its values, its losses, and its behaviour when the program has exited."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from afar import pushing, until
from daemons import environment
from opengpac.driver import Driver, Option, read, write
from opengpac.driver.handover import taken_over

FURNACE = Path(__file__).parent / "furnace.py"
PATIENT = "20 s"
"""Maximum age that a busy machine does not reach."""

PROGRAM = """
import sys, time
import opengpac as gpac
cell = gpac.System("cell")
rtp = cell.processor("rtp0")
rtp.physical_device("furnace", gpac.drivers.python(sys.argv[1], folder=sys.argv[2], age_max="20 s"), exchange=rtp.timer("slow", "2 ms", 50))
print("open", flush=True)
time.sleep(3600)
"""


def told(folder: Path) -> list[str]:
    """Returns the furnace's log. Repeated transitions to the safe state are listed once."""
    file = folder / "told"
    lines = file.read_text().split("\n")[:-1] if file.exists() else []
    return [line for line, _ in itertools.groupby(lines)]


def opened(cell: gpac.System, folder: Path, **options: Any) -> tuple[gpac.PhysicalDevice, gpac.Source]:
    """Returns the furnace, and the source that exchanges with it every 2 ms."""
    rtp = cell.processor("rtp0")
    slow = rtp.timer("slow", period="2 ms", priority=50)
    given = {"period": "5 ms", "age_max": PATIENT, **options}
    return rtp.physical_device("furnace", gpac.drivers.python(FURNACE, folder=str(folder), **given), exchange=slow), slow


def lost(cell: gpac.System) -> str:
    """Waits until the furnace is lost; returns the reason."""
    return until(lambda: cell.statistics["physical_devices"]["furnace"]["lost"], "it is lost")


def process(cell: gpac.System, furnace: gpac.PhysicalDevice) -> int:
    """Returns the driver's process number as soon as it has been read."""
    return int(until(lambda: cell.read(furnace["pid"])[0], "it has been read"))


def test_it_is_read_and_commanded(tmp_path: Path) -> None:
    with gpac.System("cell") as cell:
        furnace, slow = opened(cell, tmp_path, ambient="300 K")
        assert furnace.about["class"] == "process"
        assert process(cell, furnace) != os.getpid()
        heat = pushing.on(slow).asynch(furnace["heater"], u=50.0)
        until(lambda: cell.read(furnace["temperature"])[0] == 350.0, "it is warm")
        assert [*cell.read(furnace["zones"])[0]] == [350.0] * 3
        assert 0.0 <= cell.read(furnace["age"])[0] < 20.0
        heat.halt()
        until(lambda: cell.read(furnace["temperature"])[0] == 300.0, "what nobody commands is safe")
    # The driver enters the safe state when it is closed, and also by itself if it notices the loss earlier.
    assert [what for what, _ in groupby(told(tmp_path))] == ["open", "safe 0", "close"]


def test_under_the_virtual_clock_it_is_in_this_process(tmp_path: Path) -> None:
    with gpac.System("cell", clock="virtual") as cell:
        furnace, slow = opened(cell, tmp_path)
        heat = pushing.on(slow).asynch(furnace["heater"], u=2.0)
        cell.advance("20 ms")
        assert tuple(cell.read(furnace["temperature"], furnace["pid"], furnace["age"])) == (22.0, os.getpid(), 0.0)
        heat.halt()
        (tmp_path / "raises").touch()
        cell.advance("20 ms")
        assert cell.statistics["physical_devices"]["furnace"]["lost"] == "ValueError: its door is open"


@pytest.mark.parametrize(("how", "why"), [("raises", "ValueError: its door is open"), ("lies", "TypeError: zones are warm")])
def test_what_it_raises_loses_the_device(tmp_path: Path, how: str, why: str) -> None:
    with gpac.System("cell") as cell:
        furnace, _ = opened(cell, tmp_path)
        (tmp_path / how).touch()
        assert lost(cell) == why
        (tmp_path / how).unlink()
        furnace.reopen()
        assert cell.statistics["physical_devices"]["furnace"]["lost"] is None
        assert told(tmp_path)[:3] == ["open", "safe 0", "close"]


def test_a_process_that_is_killed_loses_the_device(tmp_path: Path) -> None:
    with gpac.System("cell") as cell:
        furnace, _ = opened(cell, tmp_path)
        before = process(cell, furnace)
        os.kill(before, signal.SIGKILL)
        assert "killed" in lost(cell)
        furnace.reopen()
        until(lambda: process(cell, furnace) != before, "another process serves it")


def test_an_exchange_that_hangs_loses_the_device(tmp_path: Path) -> None:
    with gpac.System("cell") as cell:
        furnace, _ = opened(cell, tmp_path, age_max="1 s")
        pid = process(cell, furnace)
        (tmp_path / "hangs").touch()
        assert "its newest readings are" in lost(cell)
    until(lambda: not Path(f"/proc/{pid}").exists(), "nothing is left of its process")


def test_when_the_program_is_killed_it_brings_its_safe_state(tmp_path: Path) -> None:
    words = [sys.executable, "-c", PROGRAM, str(FURNACE), str(tmp_path)]
    with subprocess.Popen(words, env=environment(), stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "open\n"
        program.kill()
    until(lambda: told(tmp_path)[-1] == "close", "it is closed")
    assert told(tmp_path)[1].startswith("safe 0")


def test_the_next_process_waits_for_the_one_that_a_killed_program_left(tmp_path: Path) -> None:
    words = [sys.executable, "-c", PROGRAM, str(FURNACE), str(tmp_path)]
    with subprocess.Popen(words, env=environment(), stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "open\n"
        (tmp_path / "lingers").touch()
        until(lambda: (tmp_path / "lingering").exists(), "its process is within a long exchange")
        program.kill()
        program.wait()
        with gpac.System("cell") as cell:
            opened(cell, tmp_path)
            assert [what for what, _ in groupby(told(tmp_path))][:4] == ["open", "safe 0", "close", "open"], (
                "opened when it was safe and closed"
            )


def test_a_process_that_is_left_and_does_not_end_is_named(tmp_path: Path) -> None:
    made = "import sys, time; from opengpac.driver.handover import taken_over; sign = taken_over(sys.argv[1]); print(); time.sleep(3600)"
    launch = "import subprocess, sys; left = subprocess.Popen(sys.argv[1:]); print(left.pid, flush=True); left.wait()"
    device = str(tmp_path)
    words = [sys.executable, "-c", launch, sys.executable, "-c", made, device]
    with subprocess.Popen(words, env=environment(), stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        left = int(program.stdout.readline())
        assert program.stdout.readline() == "\n"
        taken_over(device, patience_s=0.0).close()  # its program lives
        program.kill()
        program.wait()
        try:
            with pytest.raises(TimeoutError, match=rf"process {left} of a killed program still holds the device; .*kill -9 {left}"):
                until(lambda: taken_over(device, patience_s=0.01).close(), "it is not waited for")
        finally:
            os.kill(left, signal.SIGKILL)
        taken_over(device).close()


def test_a_process_of_another_user_holds_nothing_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device, other = str(tmp_path), os.getuid() + 1
    monkeypatch.setattr(os, "getppid", lambda: 1)
    with taken_over(device), pytest.raises(TimeoutError, match=rf"process {os.getpid()} of a killed program still holds the device"):
        taken_over(device, patience_s=0.01)
    monkeypatch.setattr(os, "getuid", lambda: other)
    with taken_over(device):
        taken_over(device, patience_s=0.01).close()


def test_what_is_wrong_with_its_options_is_said(tmp_path: Path) -> None:
    with gpac.System("cell") as cell:
        with pytest.raises(gpac.DeviceFailed, match=r"driver Furnace has no option 'fodler'.*did you mean 'folder'"):
            opened(cell, tmp_path, fodler="x")
        rtp = cell.processors["rtp0"]
        slow = rtp.timer("other", period="2 ms", priority=40)
        with pytest.raises(gpac.DeviceFailed, match=r"driver Furnace needs option 'folder'.*where it writes down"):
            rtp.physical_device("furnace", gpac.drivers.python(FURNACE), exchange=slow)
        with pytest.raises(gpac.DeviceFailed, match=r"option 'levels' of driver Furnace must be of type int, not 'many'"):
            rtp.physical_device("furnace", gpac.drivers.python(FURNACE, folder="x", levels="many"), exchange=slow)
        with pytest.raises(gpac.DeviceFailed, match=r"has no driver 'Furnce'.*did you mean 'Furnace'"):
            rtp.physical_device("furnace", gpac.drivers.python(FURNACE, class_="Furnce", folder="x"), exchange=slow)


def test_what_is_no_driver_is_refused() -> None:
    class Inner(Driver):
        """Driver inside a function."""

    Inner.__module__ = "__main__"
    with pytest.raises(gpac.CallError, match="defined in the program itself"):
        gpac.drivers.python(Inner)
    with pytest.raises(gpac.CallError, match=r"file 'nowhere.py' does not exist"):
        gpac.drivers.python("nowhere.py")
    with pytest.raises(gpac.DefinitionError, match=r"a channel cannot have type 'duble'.*did you mean 'double'"):
        read("duble")


def test_a_class_can_be_used_by_itself() -> None:
    class Lamp(Driver):
        """Lamp with a power."""

        watts: float = Option("its power", 5.0, unit="W")
        light = read("bool")
        on = write("bool")

        def exchange(self) -> None:
            self.light = self.on

    lamp = Lamp(watts="60 W")
    assert (lamp.watts, lamp.light, lamp.on) == (60.0, False, False)
    lamp.on = True
    lamp.exchange()
    assert lamp.light
