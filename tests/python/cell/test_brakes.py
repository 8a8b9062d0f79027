# SPDX-License-Identifier: Apache-2.0
"""A brake in the ending list of a device's verb: it engages while the effort still holds, and only then the effort drops."""

from __future__ import annotations

import itertools
from typing import Any

import pytest

import opengpac as gpac
from cell_rig import channel
from opengpac import activate, deactivate, execute, ready, wait
from opengpac import library as lib

HOLDING = 5.0


def braked(ending: str | None = "brake") -> type[gpac.LogicalDevice]:
    """Returns a type of axes with a brake: 20 ms to release, 30 ms to engage. The channel `brake` is true while it is released."""
    going = [activate("hold", every="1 ms"), activate("effort"), activate("brake", every="1 ms")]
    verb = gpac.Verb(
        "braked_servo",
        blocks={
            "hold": lib.set_analog(value=HOLDING),
            "effort": lib.write_channel,
            "release": lib.set_digital(value=True),
            "engage": lib.set_digital(value=False),
            "brake": lib.write_digital,
        },
        instantiation_parameters={"motor": "effort.channel", "holder": "brake.channel"},
        cells={"effort": ["hold.y", "effort.u"], "released": ["release.y", "engage.y", "brake.u"]},
        command_lists={
            "start": [*going[:2], execute("release"), going[2], wait("20 ms"), ready()],
            "brake": [*going, execute("engage"), wait("30 ms"), deactivate("hold"), deactivate("effort"), deactivate("brake")],
        },
        initial="start",
        ending=ending,
    )

    class Axis(gpac.LogicalDevice, verb=verb):
        """Axis whose brake holds it while it is disabled."""

    return Axis


class Machine:
    """Axis, and the histories of the values written to its motor and its brake."""

    def __init__(self, cell: gpac.System) -> None:
        self.cell = cell
        self.fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        channels = [
            channel("effort", "write", "double"), channel("effort_seen", type="double", loop_of="effort"),
            channel("brake", "write"), channel("brake_seen", loop_of="brake"),
        ]  # fmt: skip
        drive = self.fast.processor.physical_device("drive", gpac.drivers.scripted(channels), exchange=self.fast)
        self.axis = braked()("axis", motor=drive["effort"], holder=drive["brake"], on=self.fast)
        self.effort, self.released = cell.svv("effort", history=500), cell.svv("released", bool, history=500)
        self.drive = drive
        self.see()
        cell.advance("5 ms")

    def see(self) -> None:
        """Follows the written values."""
        seeing = gpac.Verb(
            "seeing",
            blocks={"e": lib.read_channel, "b": lib.read_digital},
            instantiation_parameters={"effort": "e.channel", "brake": "b.channel", "e": "e.y", "b": "b.y"},
            command_lists={"start": [activate("e", every="1 ms"), activate("b", every="1 ms")]},
        )
        channels = {"effort": self.drive["effort_seen"], "brake": self.drive["brake_seen"]}
        seeing.on(self.fast).asynch(**channels, e=self.effort, b=self.released)

    def changes(self, svv: gpac.SVV[Any], since: float) -> list[tuple[int, Any]]:
        """Returns the changes of an SVV: (ms after `since`, value)."""
        rows = [row for row in svv.history[:] if row["time"] > since]
        pairs = itertools.pairwise(rows)
        return [(round((row["time"] - since) * 1e3), row["value"].item()) for before, row in pairs if row["value"] != before["value"]]


@pytest.fixture
def machine(cell: gpac.System) -> Machine:
    return Machine(cell)


def test_enabling_takes_the_time_of_the_brake(machine: Machine) -> None:
    before = machine.cell.now
    machine.axis.enable()
    assert machine.cell.now - before == pytest.approx(0.020, abs=0.002)


def test_the_effort_holds_until_the_brake_has_engaged(machine: Machine) -> None:
    machine.axis.enable()
    before = machine.cell.now
    machine.axis.disable()
    assert machine.axis.state == "disabled"
    machine.cell.advance("5 ms")
    ((brake_at, released),) = machine.changes(machine.released, before)
    ((effort_at, effort),) = machine.changes(machine.effort, before)
    assert (released, effort) == (False, 0.0)
    assert brake_at <= 3
    assert effort_at - brake_at == pytest.approx(29, abs=1)


def test_leaving_the_block_of_an_enabled_axis_engages_it(machine: Machine) -> None:
    with machine.axis.enabled():
        machine.cell.advance("10 ms")
        before = machine.cell.now
    assert machine.cell.now - before == pytest.approx(0.030, abs=0.003), "it waits for the brake"
    machine.cell.advance("5 ms")
    assert [value for _, value in machine.changes(machine.released, before)] == [False]


def test_an_emergency_stop_engages_it_at_once(machine: Machine) -> None:
    machine.axis.enable()
    before = machine.cell.now
    machine.cell.emergency_stop("pressed")
    machine.cell.advance("2 ms")
    assert machine.axis.state == "disabled", "it does not wait for the brake"
    assert machine.cell.now - before <= 0.003
    machine.cell.reset()
    machine.see()
    machine.cell.advance("3 ms")
    assert (machine.released.value, machine.effort.value) == (False, 0.0)
    machine.axis.enable()
    assert machine.axis.state == "standstill"


def test_the_end_says_what_it_was_and_not_that_the_brake_engaged(machine: Machine) -> None:
    machine.axis.enable()
    machine.axis.disable()
    ends = [entry["text"] for entry in machine.cell.log() if entry["kind"] == "end"]
    assert [end.split(":")[0] for end in ends] == ["device_disabled"]
    assert len(machine.cell.alarms) == 0
