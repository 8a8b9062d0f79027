# SPDX-License-Identifier: Apache-2.0
"""An emergency stop crosses processes, in both directions."""

from __future__ import annotations

from typing import Any

import pytest

import opengpac as gpac
from afar import Afar, pushing, until
from cell_rig import channel
from opengpac import activate, library

pytestmark = pytest.mark.alone

SIGNALS = [channel("set", "write"), channel("stop", loop_of="set")]

setting = gpac.Verb(
    "setting",
    blocks={"set": library.set_digital, "write": library.write_digital},
    instantiation_parameters={"channel": "write.channel"},
    input_parameters={"on": "set.value"},
    cells={"c": ["set.y", "write.u"]},
    command_lists={"start": [activate("set", every="2 ms"), activate("write", every="2 ms")]},
)
"""Writes a digital output until it is ended."""


@pytest.mark.parametrize("input_is_there", [True, False])
def test_an_input_of_one_stops_the_outputs_of_the_other(afar: Afar, input_is_there: bool) -> None:
    sides: list[tuple[Any, Any]] = [(afar.rtp0, afar.here), (afar.rtp1, afar.there)]
    (rtp, source), (other_rtp, other) = reversed(sides) if input_is_there else sides
    signals = rtp.physical_device("signals", gpac.drivers.scripted(SIGNALS), exchange=source)
    drives = other_rtp.physical_device("drives", gpac.drivers.loopback("x"), exchange=other)
    afar.cell.emergency_stop_input(signals["stop"])
    pushed = pushing.on(other).asynch(drives["x"].effort, u=1.0)
    assert pushed.state == "running"
    setting.on(source).asynch(channel=signals["set"], on=True)
    with pytest.raises(gpac.Terminated, match=r"emergency_stop.*signals\.stop"):
        pushed.wait()
    with pytest.raises(gpac.EmergencyStopped, match=r"signals\.stop"):
        pushing.on(other).asynch(drives["x"].effort, u=1.0)
    until(lambda: _resets(afar.cell), "the input is back, and the stop is reset")
    again = pushing.on(other).asynch(drives["x"].effort, u=1.0)
    assert again.state == "running"
    again.halt()


def _resets(cell: gpac.System) -> bool:
    try:
        cell.reset()
    except (gpac.EmergencyStopped, gpac.InvalidState):
        # The input is still active, or an instance has not ended yet.
        return False
    return True
