# SPDX-License-Identifier: Apache-2.0
"""A lost physical device: nothing starts on its frozen readings, these keep their age, and it can be reopened in place."""

from __future__ import annotations

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac import activate, library
from opengpac.robots import move

REFUSED = r"cannot enable 'arm\.x': physical device 'drives' is lost: the loopback device fails.*reopen\(\)"


def lost(cell: gpac.System) -> Bench:
    """Returns a bench whose drives were lost at 500 ms while its arm was enabled; after reopening they are lost again after the same
    time."""
    bench = Bench(cell, fail_at="500 ms", initial=[0.5, 0.5])
    bench.arm.enable()
    cell.advance("510 ms")
    assert bench.arm.x.state == "fault"
    return bench


def states(cell: gpac.System) -> list[tuple[str, str, str]]:
    """Returns code, source and state of each alarm."""
    return [(alarm.code, alarm.source, alarm.state) for alarm in cell.alarms]


def test_it_cannot_be_enabled_as_long_as_nothing_new_is_read(cell: gpac.System) -> None:
    bench = lost(cell)
    read = (bench.arm.x.sensed.number, bench.arm.x.sensed.time)
    for _ in range(3):
        with pytest.raises(gpac.DeviceFailed, match=REFUSED):
            bench.arm.x.enable()
        assert bench.arm.x.state == "fault"
        cell.advance("20 ms")
    assert (bench.arm.x.sensed.number, bench.arm.x.sensed.time) == read


def test_what_goes_on_reading_it_stores_nothing_new(cell: gpac.System) -> None:
    bench = Bench(cell, fail_at="50 ms", initial=[0.5, 0.5])
    seen = cell.svv("seen", unit="rad", history=1000)
    reading = gpac.Verb(
        "reading", blocks={"read": library.read_channel}, instantiation_parameters={"channel": "read.channel", "y": "read.y"},
        command_lists={"start": [activate("read", every="1 ms")], "on": [activate("read", every="1 ms")]}, initial="start",
        transitions={("start", "device_lost"): "on"},
    ).on(bench.fast).asynch(channel=bench.drives["x"].position, y=seen)  # fmt: skip
    cell.advance("40 ms")
    assert seen.time == pytest.approx(cell.now, abs=0.0011)
    cell.advance("100 ms")
    assert reading.state == "running"
    assert seen.time == pytest.approx(0.049, abs=0.0011)
    assert max(seen.history[:]["time"]) == seen.time
    number = seen.number
    bench.drives.reopen()
    cell.advance("40 ms")
    assert seen.time == pytest.approx(cell.now, abs=0.0011)
    assert seen.number > number


@pytest.mark.parametrize("by", ["reopen", "reset"])
def test_it_is_opened_again_with_everything_that_is_bound_to_it(cell: gpac.System, by: str) -> None:
    bench = lost(cell)
    assert states(cell) == [("device_lost", "drives", "active")]
    if by == "reset":
        cell.reset()
    else:
        bench.drives.reopen()
    assert states(cell) == [("device_lost", "drives", "returned")]
    before = cell.now
    bench.arm.enable()
    assert bench.arm.x.sensed.time >= before
    assert bench.arm.x.sensed.value == 0.5
    assert move(bench.arm, goal=[0.501, 0.5]).condition == "arrived"
    cell.alarms.acknowledge()
    assert states(cell) == []


def test_it_may_be_lost_again(cell: gpac.System) -> None:
    bench = lost(cell)
    bench.drives.reopen()
    bench.arm.enable()
    cell.advance("510 ms")
    assert bench.arm.x.state == "fault"
    assert [(alarm.code, alarm.count, alarm.active) for alarm in cell.alarms] == [("device_lost", 2, True)]
    with pytest.raises(gpac.DeviceFailed, match=REFUSED):
        bench.arm.x.enable()


def test_to_open_one_that_is_not_lost_is_nothing(cell: gpac.System) -> None:
    bench = Bench(cell)
    bench.arm.enable()
    move(bench.arm, goal=[0.1, 0.1])
    bench.drives.reopen()
    assert bench.arm.x.state == "standstill"
    assert bench.arm.x.sensed.value == pytest.approx(0.1, abs=0.01)
