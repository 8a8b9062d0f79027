# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C and threads while a cell is paused, waiting or stopped, under the real clock."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac.cell import set_output, wait_for_input
from opengpac.robots import move


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Yields the small cell under the real clock, its arm enabled."""
    with gpac.System("real") as cell:
        made = Bench(cell)
        made.arm.enable()
        yield made


def interrupted(call: Callable[[], object], when: Callable[[], bool]) -> None:
    """Makes a call, interrupts it as soon as `when` holds, and expects the interruption."""

    def interrupt() -> None:
        while not when():
            pass
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        call()
    thread.join()


def states(cell: gpac.System) -> list[str]:
    return [i["state"] for i in cell.statistics["instances"] if i["verb"] not in ("robot_joint_servo", "digital_input", "digital_output")]


def test_ctrl_c_ends_a_call_that_is_held_back(bench: Bench) -> None:
    cell = bench.cell
    cell.pause()
    interrupted(lambda: move(bench.arm, goal=[1.0, 1.0]), lambda: states(cell) == ["suspended"])
    assert states(cell) == []
    assert cell.paused is True
    cell.resume()
    assert move(bench.arm, goal=bench.arm.values("sensed")).condition == "arrived"


def test_ctrl_c_ends_a_call_that_was_paused(bench: Bench) -> None:
    cell = bench.cell

    def pause_it() -> bool:
        return states(cell) == ["running"] and bool(cell.pause())

    interrupted(lambda: move(bench.arm, goal=[1.0, 1.0]), pause_it)
    assert states(cell) == []


def test_ctrl_c_ends_a_wait_for_an_input(bench: Bench) -> None:
    interrupted(lambda: wait_for_input(bench.io["gate"]), lambda: states(bench.cell) == ["running"])
    assert states(bench.cell) == []


def test_another_thread_resumes_what_waits(bench: Bench) -> None:
    cell, valve = bench.cell, bench.output()
    cell.pause()
    done: list[str] = []
    thread = threading.Thread(target=lambda: done.append(set_output(valve, True).condition))
    thread.start()
    while states(cell) != ["suspended"]:
        pass
    assert valve.value.value is False
    cell.resume()
    thread.join()
    assert (done, valve.value.value) == (["written"], True)


def test_another_thread_stops_what_waits(bench: Bench) -> None:
    cell = bench.cell
    thread = threading.Thread(target=lambda: (wait_until(lambda: states(cell) == ["running"]), cell.emergency_stop("the other thread")))
    thread.start()
    with pytest.raises(gpac.Terminated, match="the other thread"):
        move(bench.arm, goal=[1.0, 1.0], speed=0.01)
    thread.join()
    with pytest.raises(gpac.EmergencyStopped, match="the other thread"):
        bench.arm.enable()


def wait_until(holds: Callable[[], bool]) -> None:
    while not holds():
        pass
