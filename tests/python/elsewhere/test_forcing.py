# SPDX-License-Identifier: Apache-2.0
"""Signals of a processor in a process of its own are forced there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from afar import Afar, children, until
from cell_rig import channel
from daemons import environment
from opengpac import _native
from opengpac.cell import DigitalInput, DigitalOutput
from orphans import lives

pytestmark = pytest.mark.alone

SIGNALS = [channel("valve", "write"), channel("seen", loop_of="valve"), channel("gate")]


def test_a_force_crosses_processes_and_ends_there(afar: Afar) -> None:
    io = afar.rtp1.physical_device("io", gpac.drivers.scripted(SIGNALS), exchange=afar.there)
    valve, seen, gate = DigitalOutput("valve", io["valve"]), DigitalInput("seen", io["seen"]), DigitalInput("gate", io["gate"])
    for device in (valve, seen, gate):
        device.enable()
    with afar.cell.force(gate, True), afar.cell.force(valve, True):
        until(lambda: gate.value.value and seen.value.value, "both are forced")
    until(lambda: not gate.value.value and not seen.value.value, "both are released")
    afar.cell.force(valve, True)
    until(lambda: seen.value.value, "it is forced again")
    afar.cell.emergency_stop("a person came in")
    assert not afar.cell.forced
    until(lambda: _resets(afar.cell), "everything has ended")
    seen.enable()
    valve.enable()
    until(lambda: seen.value.number > 3, "it is read again")
    assert seen.value.value is False


def _resets(cell: gpac.System) -> bool:
    try:
        cell.reset()
    except gpac.InvalidState:
        return False
    return True


FORCES = """
    import sys
    import time

    import opengpac as gpac
    from afar import until
    from cell_rig import channel
    from opengpac import activate, library
    from opengpac.cell import DigitalInput, DigitalOutput

    cell = gpac.System(sys.argv[1], progress=False)
    cell.processor("rtp0")
    rtp1 = cell.processor("rtp1", process=True)
    there = rtp1.timer("fast", period="1 ms", priority=80)
    signals = gpac.drivers.scripted([channel("valve", "write"), channel("seen", loop_of="valve")])
    plant = gpac.drivers.plant_process(signals, name=sys.argv[1], step="1 ms", linger="1 s")
    io = rtp1.physical_device("io", plant, exchange=there)
    valve, seen = DigitalOutput("valve", io["valve"], at_enable=True).enable(), DigitalInput("seen", io["seen"]).enable()
    keeping = gpac.Verb(
        "keeping",
        blocks={"kept": library.signal_generator(amplitude=0.0)},
        instantiation_parameters={"y": "kept.y"},
        command_lists={"start": [activate("kept", every="2 ms")]},
        if_cut_off="continue",
    )
    keeping.on(there).asynch(cell.svv("level"))
    until(lambda: seen.value.value, "the valve is open, as commanded")
    cell.force(valve, False)
    until(lambda: not seen.value.value, "it is forced shut")
    print("forced", flush=True)
    time.sleep(600)
"""


def test_an_orphaned_process_releases_its_forces_and_goes_on() -> None:
    name = f"forced-orphan-{os.getpid()}"
    path = os.pathsep.join([str(Path(__file__).parents[1]), environment()["PYTHONPATH"]])
    program = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(FORCES), name],
        env=environment(PYTHONPATH=path),
        stdout=subprocess.PIPE,
        text=True,
    )
    assert program.stdout is not None
    assert program.stdout.readline().strip() == "forced"
    left = [*children("run_processor", program.pid), *children("run_guard", program.pid)]
    assert _plant(name)["readings"] == [0]
    program.kill()
    program.wait(60)
    program.stdout.close()
    until(lambda: _plant(name)["readings"] == [1], "the valve has the value that its process commands")
    assert not _plant(name)["is_safe"], "the guard has not acted: the process goes on"
    until(lambda: not any(map(lives, left)), "nothing of it is left over")


def _plant(name: str) -> dict[str, Any]:
    """Returns the state of the plant."""
    text = _native.plant_state(name)
    assert text is not None, "the plant runs"
    state: dict[str, Any] = json.loads(text)
    return state
