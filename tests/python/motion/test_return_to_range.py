# SPDX-License-Identifier: Apache-2.0
"""Joints outside their range: `enable` reports them, and a call drives them back in, slowly."""

from __future__ import annotations

import logging

import numpy as np
import pytest

import opengpac as gpac
from opengpac import motion


def axes(*starts: float, low: float = -0.5, high: float = 0.2) -> gpac.Group[gpac.robots.Joint]:
    """Returns axes at these positions, in rad, each with that range."""
    cell = gpac.System("outside", clock="virtual")
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="1 ms", priority=80)
    rtp.timer("slow", period="20 ms", priority=60)
    names = [f"x{n}" for n in range(len(starts))]
    device = rtp.physical_device("d", gpac.drivers.loopback(*names, initial=[*starts]), exchange=fast)
    limits = {"position_min": low, "position_max": high, "kp": 50.0, "kd": 0.0}
    return gpac.Group("axes", *(gpac.robots.Joint(name, drive=device[name], on=fast, **limits) for name in names))


def test_a_joint_that_is_enabled_outside_its_range_says_so_and_stays(caplog: pytest.LogCaptureFixture) -> None:
    group = axes(0.3, 0.1, -0.9)
    with group.system as cell:
        group.enable()
        told = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
        assert [text.partition(",")[0] for text in told] == ["joint 'x0' is at 0.3 rad", "joint 'x2' is at -0.9 rad"]
        assert "outside its range, -0.5 to 0.2 rad, and stays there; move it back with gpac.motion.return_to_range(…)" in told[0]
        cell.advance("300 ms")
        assert np.allclose(group.values("sensed"), [0.3, 0.1, -0.9])


def test_it_is_driven_back_at_a_tenth_of_its_speed_and_the_others_stay() -> None:
    group = axes(0.3, 0.1, -0.9)
    with group.system:
        report = motion.return_to_range(group.enable())
        assert report is not None and report.condition == "arrived"
        assert np.allclose(group.values("sensed"), [0.2, 0.1, -0.5], atol=2e-3)
        for joint, speed in zip(group, (0.1, 0.0, 0.1), strict=True):
            assert np.abs(np.diff(joint.commanded.history[:]["value"])).max(initial=0.0) <= 0.02 * speed * joint.max_speed * (1 + 1e-9)
        assert motion.return_to_range(group) is None, "they are there"
        assert motion.return_to_range(group[1]) is None


def test_nothing_is_said_within_and_of_a_joint_that_does_not_know_where_it_is(caplog: pytest.LogCaptureFixture) -> None:
    group = axes(0.2 + 1e-6, -0.5)
    with group.system:
        group.enable()
        assert not caplog.records
