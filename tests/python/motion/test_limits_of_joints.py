# SPDX-License-Identifier: Apache-2.0
"""Limits of joints are plausible, and motions have plausible ranges at each."""

from __future__ import annotations

import re

import pytest

import opengpac as gpac
from axes import machine
from opengpac import motion

ASKED = [
    ("max_speed", 200, "200 rad/s: its range is 1e-5 to 100 rad/s; did you mean '200 deg/s'?"),
    ("jog_speed", 101, "101 rad/s: its range is 1e-5 to 100 rad/s; give a value within the range"),
    ("max_acceleration", 30_000, "30000 rad/s^2: its range is 1e-5 to 10000 rad/s^2; did you mean '30000 deg/s^2'?"),
    ("max_jerk", 5e7, "50000000 rad/s^3: its range is 1e-5 to 10000000 rad/s^3; did you mean '50000000 deg/s^3'?"),
    ("max_speed", 1e-9, "1e-9 rad/s: its range is 1e-5 to 100 rad/s; give a value within the range"),
    ("max_acceleration", 1e-9, "1e-9 rad/s^2: its range is 1e-5 to 10000 rad/s^2; give a value within the range"),
]


@pytest.mark.parametrize(("limit", "value", "words"), ASKED)
def test_a_limit_that_is_not_plausible_is_refused_and_degrees_are_asked_back(limit: str, value: float, words: str) -> None:
    with (
        gpac.System("fast", clock="virtual") as cell,
        pytest.raises(gpac.OutOfRange, match=re.escape(f"'{limit}' of device 'axes.x' cannot be {words}")),
    ):
        machine(cell, on=cell.processor("rtp0"), **{limit: value})


@pytest.mark.parametrize("limit", ["max_speed", "max_acceleration", "max_jerk"])
def test_a_motion_has_a_range_at_the_least_and_the_largest_limit(limit: str) -> None:
    with gpac.System("ends", clock="virtual") as cell:
        axes = machine(cell, on=cell.processor("rtp0"))
        for joint in axes:
            within = type(joint).parameter_members()[limit].within
            least, most = (float(end) for end in str(within).strip("[]").split(","))
            for value in (least, most):
                setattr(joint, limit, value)
                with pytest.raises(motion.MoveTimeout):
                    motion.move_absolute(joint, 1.0, time_limit="40 ms")
            setattr(joint, limit, 1.0)
