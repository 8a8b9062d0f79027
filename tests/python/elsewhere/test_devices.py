# SPDX-License-Identifier: Apache-2.0
"""A device that a separate process has opened: the state of its outputs and its users when that process ends."""

from __future__ import annotations

import signal
import struct

import pytest

import opengpac as gpac
from afar import Afar, Guarded, looking, pushing, until

pytestmark = pytest.mark.alone


def position(plant: Guarded) -> float:
    """Returns the position of a part of the plant."""
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
    alarms = [(alarm.code, alarm.source, alarm.count) for alarm in afar.cell.alarms]
    assert alarms == [("processor_lost", "rtp1", 1)], "one cause, one alarm"
    where = position(plant)
    afar.cell.reset()
    assert [alarm.state for alarm in afar.cell.alarms] == ["returned"]
    again = pushing.on(afar.there).asynch(plant.device["x"].effort, u=2.0)
    until(lambda: position(plant) > where + 0.02, "the plant is pushed again")
    again.halt()


@pytest.mark.parametrize("by", ["reopen", "reset"])
def test_a_device_that_is_lost_there_is_opened_again(afar: Afar, by: str) -> None:
    drives = afar.rtp1.physical_device("drives", gpac.drivers.loopback("x", initial=[0.25], fail_at="300 ms"), exchange=afar.there)
    process = afar.process()
    q = afar.cell.svv("q")
    with pytest.raises(gpac.Terminated) as caught:
        looking.on(afar.there)(channel=drives["x"].position, q=q, time_limit="60 s")
    assert caught.value.condition == "device_lost"
    with pytest.raises(gpac.DeviceFailed, match=r"cannot start 'looking#.*physical device 'drives' is lost"):
        looking.on(afar.there).asynch(channel=drives["x"].position, q=afar.cell.svv("refused"))
    if by == "reset":
        afar.cell.reset()
    else:
        drives.reopen()
    again = afar.cell.svv("again")
    with pytest.raises(gpac.Terminated, match="device_lost"):
        looking.on(afar.there)(channel=drives["x"].position, q=again, time_limit="60 s")
    assert again.value == 0.25
    assert afar.process() == process
