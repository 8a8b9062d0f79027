# SPDX-License-Identifier: Apache-2.0
"""The largest possible call fits the control interface: a path of 4,096 way-points of 16 joints."""

from __future__ import annotations

import numpy as np
import pytest

import opengpac as gpac
from opengpac import motion

JOINTS, POINTS = 16, 4096


def test_the_longest_path_of_the_most_joints_is_one_call(far: gpac.System) -> None:
    fast = far.processor("rtp1").timer("fast", period="1 ms", priority=80)
    slow = fast.processor.timer("slow", period="20 ms", priority=60)
    names = [f"j{at}" for at in range(JOINTS)]
    plant = fast.processor.physical_device("plant", gpac.drivers.loopback(*names), exchange=fast)
    joints = [gpac.robots.Joint(name, drive=plant[name], on=fast, kp=50.0, kd=0.0, max_following_error=1.0) for name in names]
    arm = gpac.Group("many", *joints).enable()
    share = np.linspace(0, 1, POINTS)[:, None]
    points = np.sin(share * np.linspace(0.1, 0.3, JOINTS)) * np.pi / 10
    assert len(str(points.tolist())) > 1 << 20, "more than fitted before"
    moved = motion.follow_long.on(slow).asynch(arm, points, blend=0.001, speed=1.0)
    moved.wait()
    assert moved.report.condition == "arrived"
    assert arm.values("commanded") == pytest.approx(list(points[-1]))


def test_a_call_that_is_larger_is_refused_in_words(far: gpac.System) -> None:
    table = far.svv("table", "double[200000]")
    with pytest.raises(gpac.Error, match="the body has more than 2097152 bytes"):
        table.value = np.full(200_000, 1 / 3)
