# SPDX-License-Identifier: Apache-2.0
"""A plant in a process of its own: commanded like a local one, and alive after its commander has exited."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from typing import Any

import opengpac as gpac
from opengpac import _native, activate, library, on

push = gpac.Verb(
    "push",
    blocks={
        "push": library.signal_generator(amplitude=0.0, offset=1.0),
        "write": library.write_channel,
        "read": library.read_channel,
        "far": library.await_range(low=0.01, high=1e6),
    },
    instantiation_parameters={"drive.position": "read.channel", "drive.effort": "write.channel"},
    cells={"u": ["push.y", "write.u"], "q": ["read.y", "far.u"]},
    output_values={"position": "read.y"},
    command_lists={"start": [activate("push", every="2 ms"), activate("write"), activate("read", every="2 ms"), activate("far")]},
    conditions={"far": on("far.done", returns=["position"])},
)

COMMANDER = """
import os, signal, sys
import opengpac as gpac
cell = gpac.System("commander", progress=False)
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="2 ms", priority=80)
driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=sys.argv[1])
rtp.physical_device("drives", driver, exchange=fast)
os.kill(os.getpid(), signal.SIGKILL)
"""


def pushed(cell: gpac.System, driver: gpac.drivers.Driver) -> Any:
    """Pushes a part of a loopback plant until it has moved far."""
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="2 ms", priority=80)
    drives = rtp.physical_device("drives", driver, exchange=fast)
    return push.on(fast)(drives["x"], time_limit="10 s")


def state(name: str) -> dict[str, Any] | None:
    """Returns the state of the plant of that name."""
    text = _native.plant_state(name)
    return None if text is None else json.loads(text)


def test_under_the_virtual_clock_a_plant_runs_in_place() -> None:
    inner = gpac.drivers.loopback("x", "y", initial=[0.0, 0.5])
    reports = []
    for driver in (inner, gpac.drivers.plant_process(inner, name="test-in-place")):
        with gpac.System("virtual", clock="virtual") as cell:
            reports.append(pushed(cell, driver))
            assert state("test-in-place") is None
    assert (reports[0].position, reports[0].time) == (reports[1].position, reports[1].time)


def test_a_plant_is_commanded_in_its_process_and_put_away_with_its_system(real_cell: gpac.System) -> None:
    driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name="test-commanded")
    assert pushed(real_cell, driver).position >= 0.01
    plant = state("test-commanded")
    assert plant is not None and struct.unpack_from("d", bytes(plant["readings"]))[0] >= 0.01
    real_cell.close()
    assert state("test-commanded") is None


def test_a_plant_outlives_who_commanded_it_until_somebody_comes_back(real_cell: gpac.System) -> None:
    run = subprocess.run([sys.executable, "-c", COMMANDER, "test-outlives"], check=False, timeout=300)
    assert run.returncode == -9
    before = state("test-outlives")
    assert before is not None
    driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name="test-outlives")
    assert pushed(real_cell, driver).position >= 0.01
    after = state("test-outlives")
    assert after is not None and after["pid"] == before["pid"]
    real_cell.close()
    assert state("test-outlives") is None
