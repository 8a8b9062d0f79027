# SPDX-License-Identifier: Apache-2.0
"""Signals of a processor in a process of its own are forced there."""

from __future__ import annotations

import pytest

import opengpac as gpac
from afar import Afar, until
from cell_rig import channel
from opengpac.cell import DigitalInput, DigitalOutput

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
