# SPDX-License-Identifier: Apache-2.0
"""The reference of a servo between a motion's set-points: speed, acceleration and steps of acceleration, at 1 ms."""

from __future__ import annotations

import random
from collections.abc import Iterator

import numpy as np
import pytest

import opengpac as gpac
from opengpac import motion
from opengpac.robots import Arm, Joint

PERIOD_S = 0.02
"""Period of the set-points."""

SPEEDS = ["20 %", "60 %", "100 %"]


@pytest.fixture(scope="module")
def arm() -> Iterator[Arm]:
    made = gpac.robots.load("ur5e", clock="virtual", arbitration="abort").enable()
    with made.system:
        motion.move_absolute(made, gpac.deg([0, -90, 90, -90, -90, 0]), speed="60 %")
        yield made


def span(draw: random.Random, most: int) -> str:
    return f"{draw.randrange(20, most)} ms"


def anything(arm: Arm, joint: Joint, draw: random.Random) -> None:
    """Runs a motion that arrives, is halted, changed, overridden or taken over."""
    goal, speed = draw.uniform(0.3, 2.6), draw.choice(SPEEDS)
    kind = draw.choice(["move", "halt", "velocity", "takeover", "override"])
    if kind == "velocity":
        going = motion.move_velocity.asynch(joint, draw.uniform(-0.6, 0.6))
        arm.system.advance(span(draw, 600))
        going.set(velocity=draw.uniform(-0.6, 0.6))
        arm.system.advance(span(draw, 300))
        going.halt()
        return
    moving = motion.move_absolute.asynch(joint, goal, speed=speed)
    if kind == "move":
        moving.wait()
        return
    arm.system.advance(span(draw, 600))
    if kind == "halt":
        moving.halt()
    elif kind == "takeover":
        motion.move_absolute(joint, draw.uniform(0.3, 2.6), speed=speed)
    else:
        arm.override = draw.uniform(0.1, 1.0)
        arm.system.advance(span(draw, 400))
        arm.override = 1.0
        moving.wait()


@pytest.mark.parametrize("seed", range(4))
def test_speed_and_acceleration_are_kept_and_acceleration_has_steps_of_one_set_point(arm: Arm, seed: int) -> None:
    draw, joint = random.Random(seed), arm["elbow"]
    for _ in range(6):
        begun = arm.system.now
        anything(arm, joint, draw)
        arm.system.advance("100 ms")
        rows, knots = joint.reference.history[:], joint.commanded.history[:]
        fine = rows["value"][rows["time"] >= begun - 0.065]
        speed = np.diff(fine) / 1e-3
        acceleration = np.diff(speed) / 1e-3
        coarse = knots["value"][knots["time"] >= begun - 0.065]
        within = 1 + 1e-6
        assert np.abs(speed).max() <= joint.max_speed * within
        assert np.abs(acceleration).max() <= joint.max_acceleration * within
        assert np.abs(np.diff(coarse, 3)).max() / PERIOD_S**3 <= joint.max_jerk * within
        # The mean acceleration of 1 ms contains half of a step, so two of them contain all of it.
        assert np.abs(acceleration[2:] - acceleration[:-2]).max() <= joint.max_jerk * PERIOD_S * within
