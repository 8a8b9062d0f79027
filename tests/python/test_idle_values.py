# SPDX-License-Identifier: Apache-2.0
"""Outputs that keep driving: a torque or a speed when the verb that writes it is suspended, paused or ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

import opengpac as gpac
from axes import machine
from opengpac import activate, library


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("cell", clock="virtual", progress=False) as cell:
        yield cell


def push(**more: Any) -> gpac.Verb[..., Any]:
    """Returns a verb that adds a constant torque to that of a joint's servo."""
    return gpac.Verb(
        "push",
        blocks={"wave": library.signal_generator(shape=0)},
        objects={"joint": gpac.robots.Joint},
        instantiation_parameters={"joint.load_effort": "wave.y"},
        input_parameters={"torque": "wave.offset"},
        command_lists={"start": [activate("wave", every="1 ms")]},
        **more,
    )


def write(name: str, **more: Any) -> gpac.Verb[..., Any]:
    """Returns a verb that writes a constant into a channel."""
    return gpac.Verb(
        name,
        blocks={"wave": library.signal_generator(shape=0), "write": library.write_channel},
        instantiation_parameters={"channel": "write.channel"},
        cells={"y": ["wave.y", "write.u"]},
        input_parameters={"value": "wave.offset"},
        command_lists={"start": [activate("wave", every="1 ms"), activate("write")]},
        **more,
    )


def suspended(cell: gpac.System, instance: gpac.VerbInstance[Any]) -> None:
    instance.suspend()


def paused(cell: gpac.System, instance: gpac.VerbInstance[Any]) -> None:
    cell.pause()


def halted(cell: gpac.System, instance: gpac.VerbInstance[Any]) -> None:
    instance.halt()


Stand = Callable[[gpac.System, gpac.VerbInstance[Any]], None]


def go_on(cell: gpac.System, instance: gpac.VerbInstance[Any]) -> None:
    cell.resume()
    if instance.state == "suspended":
        instance.resume()


@pytest.mark.parametrize("stand", [suspended, paused, halted])
def test_a_torque_by_way_of_a_servo_becomes_its_idle_value(cell: gpac.System, stand: Stand) -> None:
    axes = machine(cell)
    instance = push().on(cell.physical_devices["plant"].source).asynch(axes.x, torque=2.0)
    cell.advance("50 ms")
    assert axes.x.load_effort.value == 2.0
    stand(cell, instance)
    cell.advance("5 ms")
    assert axes.x.load_effort.value == 0.0
    if stand is not halted:
        go_on(cell, instance)
        cell.advance("5 ms")
        assert (instance.state, axes.x.load_effort.value) == ("running", 2.0)


@pytest.mark.parametrize("stand", [suspended, paused])
def test_an_arm_under_a_torque_stands_still_while_its_verb_is_suspended(cell: gpac.System, stand: Stand) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    plant = cell.processors["rtp0"].physical_device("plant", gpac.drivers.loopback("x"), exchange=fast)
    instance = write("torque").on(fast).asynch(plant["x.effort"], value=2.0)
    cell.advance("50 ms")
    assert cell.read(plant["x"].velocity)[0] == 2.0
    stand(cell, instance)
    cell.advance("5 ms")
    before = cell.read(plant["x"].position)[0]
    cell.advance("1 s")
    assert (cell.read(plant["x"].position)[0], cell.read(plant["x"].velocity)[0]) == (before, 0.0)
    go_on(cell, instance)
    cell.advance("5 ms")
    assert cell.read(plant["x"].velocity)[0] == 2.0


def test_a_position_stays(cell: gpac.System) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    plant = cell.processors["rtp0"].physical_device("plant", gpac.drivers.loopback("x", command="position"), exchange=fast)
    instance = write("place", suspend="hold").on(fast).asynch(plant["x.goal"], value=0.5)
    cell.advance("50 ms")
    instance.suspend()
    cell.advance("1 s")
    assert cell.read(plant["x"].position)[0] == 0.5


def test_holding_an_effort_is_refused_unless_it_is_asked_for_by_name(cell: gpac.System) -> None:
    axes = machine(cell)
    fast = cell.physical_devices["plant"].source
    with pytest.raises(gpac.DefinitionError, match=r"suspend='hold'.*SVV 'axes.x.load_effort' in N.m.*hold_last"):
        push(suspend="hold").on(fast).asynch(axes.x, torque=2.0)
    axes.disable()
    channel = cell.physical_devices["plant"]["x.effort"]
    with pytest.raises(gpac.DefinitionError, match=r"channel 'plant.x.effort' in N.m.*under a constant torque"):
        write("torque", suspend="hold").on(fast).asynch(channel, value=2.0)
    instance = write("constant", suspend="hold_last").on(fast).asynch(channel, value=2.0)
    cell.advance("50 ms")
    instance.suspend()
    cell.advance("1 s")
    assert cell.read(cell.physical_devices["plant"]["x"].velocity)[0] == 2.0


def test_a_payload_is_carried_while_the_program_is_paused() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual")
    with arm.system as cell:
        arm.enable()
        arm.payload = gpac.robots.Payload(2.0)
        cell.advance("0.1 s")
        carried = arm.values("load_effort")
        cell.pause()
        cell.advance("0.5 s")
        assert max(abs(effort) for effort in arm.values("load_effort")) > 3.0
        assert arm.values("load_effort") == pytest.approx(carried, abs=0.1)
