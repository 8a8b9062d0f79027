# SPDX-License-Identifier: Apache-2.0
"""A device that a process of its own has opened: what its outputs and its users are when that process ends."""

from __future__ import annotations

import signal
import struct

import pytest

import opengpac as gpac
from afar import Afar, Guarded, looking, pushing, until


def position(plant: Guarded) -> float:
    """Where the part of the plant is."""
    return struct.unpack_from("d", bytes(plant.state()["readings"]))[0]


def test_a_device_there_is_written_and_read(afar: Afar) -> None:
    drives = afar.rtp1.physical_device("drives", gpac.drivers.loopback("x"), exchange=afar.there)
    q = afar.cell.svv("q")
    look = looking.on(afar.there).asynch(channel=drives["x"].position, q=q)
    push = pushing.on(afar.there).asynch(drives["x"].effort, u=1.0)
    until(lambda: q.value > 0.02, "the part moves")
    push.halt()
    afar.end()
    with pytest.raises(gpac.Terminated) as caught:
        look.wait()
    assert caught.value.condition in ("device_lost", "processor_lost")
    afar.cell.reset()
    again = afar.cell.svv("again")
    pushing.on(afar.there).asynch(drives["x"].effort, u=1.0)
    looking.on(afar.there).asynch(channel=drives["x"].position, q=again)
    until(lambda: again.value > 0.02, "the part moves again")


@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGSTOP, signal.SIGABRT])
def test_outputs_are_safe_when_the_process_ends(afar: Afar, by: signal.Signals) -> None:
    plant = Guarded(afar)
    instance = pushing.on(afar.there).asynch(plant.device["x"].effort, u=1.0)
    until(lambda: position(plant) > 0.02 and not plant.state()["is_safe"], "the plant is pushed")
    afar.end(by)
    with pytest.raises(gpac.Terminated) as caught:
        instance.wait()
    assert caught.value.condition == "processor_lost"
    until(lambda: plant.state()["is_safe"], "the plant is safe")
    until(lambda: afar.log("guard"), "the log says what the guard did")
    assert "device_lost" in afar.cell.alarms
    where = position(plant)
    afar.cell.reset()
    again = pushing.on(afar.there).asynch(plant.device["x"].effort, u=2.0)
    until(lambda: position(plant) > where + 0.02, "the plant is pushed again")
    again.halt()
