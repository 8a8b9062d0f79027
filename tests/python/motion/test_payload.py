# SPDX-License-Identifier: Apache-2.0
"""A payload unknown to the plant is attached to the tool of a simulated arm."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import activate, execute
from opengpac import library as lib

MASS = 2.0


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields a UR5e under the virtual clock."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system:
        yield made


def hang(arm: gpac.robots.Arm, weight: float) -> gpac.VerbInstance[Any]:
    """Pulls the simulated tool down with a weight in N."""
    pull = gpac.Verb(
        "pull",
        blocks={"write": lib.block("write_vector")},
        instantiation_parameters={"push": "write.channel", "force": "write.u"},
        command_lists={"start": [execute("write"), activate("write", every="1 ms")]},
        modes={"write.u": "asynchronous"},
    )
    device = arm.system.physical_devices["ur5e"]
    force = arm.system.svv("force", device.channels["tool.push"].type, initial=[0.0, 0.0, -weight])
    return pull.on(device.source).asynch(device["tool.push"], force)


def sag(arm: gpac.robots.Arm) -> float:
    """Returns the distance of the joints from their commanded positions, all together."""
    arm.system.advance("1 s")
    return float(np.abs(np.array(arm.values("commanded")) - arm.values("sensed")).sum())


def test_the_payload_is_held(arm: gpac.robots.Arm) -> None:
    with arm.enabled():
        hang(arm, 9.81 * MASS)
        without = sag(arm)
        arm.payload = gpac.robots.Payload(MASS)
        assert sag(arm) < without / 20
        away = np.array([0.5, -0.3, 0.4, 0.2, 0.3, 0])
        gpac.robots.move(arm, goal=away + arm.values("home"))
        assert sag(arm) < without / 20
        arm.payload = gpac.robots.Payload(0)
        assert sag(arm) > without / 2
        assert np.abs(arm.values("load_effort")).max() == 0


def test_efforts_are_those_of_the_jacobian_at_the_centre(arm: gpac.robots.Arm) -> None:
    arm.base = gpac.Pose((1, 2, 3), rpy=("90 deg", 0, 0))
    with arm.enabled():
        arm.payload = gpac.robots.Payload(1.5, centre=(0.1, -0.05, 0.08))
        arm.system.advance("1 s")
        arm.base, arm.tool = gpac.Pose(), gpac.Pose(arm.payload.centre)
        expected = arm.jacobian().T @ [0, 0, 9.81 * 1.5, 0, 0, 0]
        assert np.allclose(arm.values("load_effort"), expected, atol=1e-3)


def test_a_payload_stays_through_disabling_and_is_taken_on_slowly(arm: gpac.robots.Arm) -> None:
    arm.payload = gpac.robots.Payload(MASS)
    with arm.enabled():
        arm.system.advance("100 ms")
        part = np.abs(arm.values("load_effort")).max()
        arm.system.advance("400 ms")
        whole = np.abs(arm.values("load_effort")).max()
        assert 0.3 * whole < part < 0.7 * whole
    with arm.enabled():
        arm.system.advance("500 ms")
        assert np.abs(arm.values("load_effort")).max() == pytest.approx(whole, rel=1e-3)
    arm.payload = gpac.robots.Payload(0)
    with arm.enabled(), pytest.raises(gpac.OutOfRange, match="'mass' cannot be -1 kg"):
        gpac.motion.carry(arm, -1.0)
