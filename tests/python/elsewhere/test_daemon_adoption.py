# SPDX-License-Identifier: Apache-2.0
"""A daemon with a journal is killed and restarted: the instances in a processor's process continue all the time."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from afar import children, shared_memory, until
from daemons import Daemon
from opengpac import _native, motion
from opengpac.robots import Joint
from orphans import HOLD_ERROR, HOLDS, lives

pytestmark = pytest.mark.alone

NAME = f"kept-{os.getpid()}"


def look() -> float:
    """Returns the position of the joint; checks that its outputs have never been made safe."""
    text = _native.plant_state(NAME)
    assert text is not None, "there is a plant"
    state = json.loads(text)
    assert not state["is_safe"], "nobody has made it safe"
    return struct.unpack_from("d", bytes(state["readings"]))[0]


def held() -> bool:
    """Returns whether the joint stands still, in many samples."""
    return all(abs(look() - HOLDS) < HOLD_ERROR for _ in range(20))


@pytest.fixture
def daemons(tmp_path: Path) -> Iterator[list[Daemon]]:
    """Yields the daemons of one journal; checks that nothing of them is left over."""
    made: list[Daemon] = []
    yield made
    for one in reversed(made):
        one.stop()
    until(lambda: _native.plant_state(NAME) is None, "the plant has gone")
    assert shared_memory(NAME) == []


def start(daemons: list[Daemon], folder: Path) -> Daemon:
    daemons.append(Daemon(folder, "monotonic", "--name", NAME, "--journal", str(folder / "cell.journal")))
    return daemons[-1]


def build(cell: gpac.System, process: bool | str) -> Joint:
    """Returns a joint whose servo runs in a process of its own or in the named one, and whose plant is in another."""
    rtp1 = cell.processor("rtp1", process=process)
    if process is not True:
        cell.processor("rtp2", process=process).software("soft", priority=50)
    fast = rtp1.timer("fast", period="1 ms", priority=80)
    rtp1.timer("slow", period="20 ms", priority=60)
    plant = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=NAME, step="1 ms", linger="10 s")
    drives = rtp1.physical_device("drives", plant, exchange=fast)
    return Joint("axis", drive=drives["x"], on=fast, kp=20.0, kd=0.0, max_following_error=0.5)


@pytest.mark.parametrize(
    ("process", "said"),
    [(True, "processor 'rtp1' was taken over: "), ("cell-a", "process 'cell-a' (processors 'rtp1', 'rtp2') was taken over: ")],
)
def test_a_joint_is_held_while_its_daemon_is_killed_and_started_again(
    daemons: list[Daemon], tmp_path: Path, process: bool | str, said: str
) -> None:
    daemon = start(daemons, tmp_path)
    cell = gpac.connect(daemon.url, name="operator")
    axis = build(cell, process).enable()
    motion.move_absolute(axis, HOLDS, time_limit="60 s")
    [there] = children("run_processor", daemon.process.pid)
    assert held()
    daemon.kill()
    assert held(), "the servo goes on without the daemon"
    daemon = start(daemons, tmp_path)
    assert held(), "the daemon that plays its journal holds it as it was"
    assert any(line.startswith(said) for line in daemon.said), daemon.said
    assert lives(there) and children("run_processor", daemon.process.pid) == [], "the process is the same"
    with gpac.connect(daemon.url, name="operator") as cell:
        assert cell.session is not None and cell.session.returned
        axis = cell.device("axis", Joint)
        assert axis.state == "standstill" and axis.commanded.value == pytest.approx(HOLDS, abs=HOLD_ERROR)
        motion.move_absolute(axis, 0.2, time_limit="60 s")
        until(lambda: abs(look() - 0.2) < HOLD_ERROR, "the joint follows whom the daemon lets in")
    daemon.stop()
    until(lambda: not lives(there), "it ends with the daemon that took it over")
