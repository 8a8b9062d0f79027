# SPDX-License-Identifier: Apache-2.0
"""Readings of a device that is off, lost or not yet read are refused where they would be used, and a simulated arm brakes like a real
one."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields a UR5e under the virtual clock, not enabled."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system:
        yield made


USES: dict[str, Callable[[gpac.robots.Arm], Any]] = {
    "pose": lambda arm: arm.pose(),
    "jacobian": lambda arm: arm.jacobian(),
    "inverse": lambda arm: arm.inverse(gpac.Pose((0.4, 0.2, 0.4))),
}


@pytest.mark.parametrize("use", USES)
def test_the_present_of_an_arm_is_known_only_while_it_is_enabled(arm: gpac.robots.Arm, use: str) -> None:
    arm.system.advance("50 ms")
    with pytest.raises(
        gpac.NotEnabled, match=r"joint '.*shoulder_pan.*' is disabled, so its position may have changed since it was last enabled"
    ):
        USES[use](arm)
    arm.enable()
    here = arm.pose()
    USES[use](arm)
    arm.disable()
    with pytest.raises(gpac.NotEnabled):
        USES[use](arm)
    assert arm.forward(arm.values("home")).distance(here) < 0.01, "of positions that are given it is computed at any time"


def test_a_channel_has_no_value_before_its_first_reading(arm: gpac.robots.Arm) -> None:
    elbow = arm.system.physical_devices["ur5e"]["elbow"]
    with pytest.raises(
        gpac.InvalidState, match=r"there is no reading yet, because source 'rtp0\..*' has not fired since device 'ur5e' was opened"
    ):
        arm.system.read(elbow.position)
    arm.system.advance("2 ms")
    assert arm.system.read(elbow.position)[0] != 0.0


def test_a_channel_is_waited_for_in_real_time() -> None:
    with gpac.System("cell", progress=False) as cell:
        slow = cell.processor("rtp0").timer("slow", period="50 ms")
        plant = cell.processors["rtp0"].physical_device("plant", gpac.drivers.loopback("x", initial=[0.7]), exchange=slow)
        assert cell.read(plant["x"].position)[0] == 0.7


def test_a_channel_of_a_lost_device_is_refused_with_the_cause() -> None:
    with gpac.System("cell", clock="virtual", progress=False) as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms")
        plant = cell.processors["rtp0"].physical_device("plant", gpac.drivers.loopback("x", fail_at="10 ms"), exchange=fast)
        cell.advance("5 ms")
        assert cell.read(plant["x"].position)[0] == 0.0
        cell.advance("20 ms")
        ages: list[float] = []
        for _ in range(3):
            cell.advance("1 s")
            with pytest.raises(gpac.DeviceFailed, match="because device 'plant' is lost: the loopback device fails") as refused:
                cell.read(plant["x"].position)
            ages += [float(age) for age in re.findall(r"its last reading is more than ([0-9.]+) s old", str(refused.value))]
        assert ages == pytest.approx([1.015, 2.015, 3.015], abs=1.1e-3), "the age of a lost device grows"


def test_an_emergency_stop_brakes_a_simulated_arm_within_the_efforts_of_its_drives(arm: gpac.robots.Arm) -> None:
    arm.enable()
    away = np.array(arm.values("home")) + np.array([1.5, 0, 0, 0, 0, 0])
    moving = gpac.robots.move.asynch(arm, goal=away, speed=1.5)
    arm.system.advance("0.6 s")
    assert not moving.done
    arm.system.emergency_stop("pressed")
    pan = arm.system.physical_devices["ur5e"]["shoulder_pan"].position
    places = [arm.system.read(pan)[0]]
    for _ in range(300):
        arm.system.advance("1 ms")
        places.append(arm.system.read(pan)[0])
    steps = np.diff(places)
    # 150 N.m slow the arm down within some ms, not at once, and never reverse it; then its brake holds it.
    assert steps[1] > 0.5e-3
    assert (steps >= 0.0).all() and (np.diff(steps) <= 1e-9).all()
    assert (steps[100:] == 0.0).all()


def test_a_channel_is_read_though_an_svv_has_its_name(arm: gpac.robots.Arm) -> None:
    cell, pan = arm.system, arm["shoulder_pan"]
    channel = cell.physical_devices["ur5e"]["shoulder_pan"].velocity
    assert channel.full_name == pan.velocity.name
    arm.enable()
    gpac.robots.move.asynch(arm, goal=np.array(arm.values("home")) + np.array([1.5, 0, 0, 0, 0, 0]), speed=1.5)
    cell.advance("0.6 s")
    assert cell.read(channel)[0] == pytest.approx(1.5, abs=0.05)
    cell.emergency_stop("pressed")
    cell.advance("0.5 s")
    assert cell.read(channel)[0] == 0.0, "the SVV has what the joint's verb took last, the channel what the machine says"
