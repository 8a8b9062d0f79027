# SPDX-License-Identifier: Apache-2.0
"""Jogging the tool of a UR5e along and about axes, under the virtual clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac.motion import JogBlocked, jog_linear, move_absolute, stop
from tool_path import places

TICK_S = 0.02


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    """Yields an enabled UR5e at home."""
    made = gpac.robots.load("ur5e", clock="virtual")
    with made.system, made.enabled():
        yield made


class Held:
    """Held button, which increments its heartbeat at each tick."""

    def __init__(self, arm: gpac.robots.Arm) -> None:
        self.arm = arm
        self.svv = arm.system.svv("button", int)

    def run(self, instance: Any, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        """Holds the button for a time, or until a condition holds."""
        for _ in range(round(seconds / TICK_S)):
            if instance.done or until():
                return
            self.svv.value = self.svv.value + 1
            self.arm.system.advance(TICK_S)


def setpoints(arm: gpac.robots.Arm, since: float) -> np.ndarray:
    """Returns the set-points since a time: one row each."""
    columns = [joint.commanded.history[:] for joint in arm]
    return np.array([column["value"][column["time"] > since] for column in columns]).T


def check_limits(arm: gpac.robots.Arm, rows: np.ndarray, speed: str = "jog_speed") -> None:
    """Checks that no set-point leaves its range, or exceeds the speed, acceleration or jerk of its joint."""
    steps = {speed: 1, "max_acceleration": 2, "max_jerk": 3}
    for member, order in steps.items():
        bound = np.array(arm.values(member)) * TICK_S**order
        found = np.abs(np.diff(rows, n=order, axis=0)).max(axis=0) if len(rows) > order else np.zeros(len(arm))
        assert (found <= bound * 1.001).all(), f"{member}: {found / TICK_S**order}"
    low, high = np.array(arm.values("position_min")), np.array(arm.values("position_max"))
    assert (rows >= low - 1e-9).all() and (rows <= high + 1e-9).all()


@pytest.mark.parametrize("in_tool", [False, True])
def test_the_speed_along_an_axis_is_held(arm: gpac.robots.Arm, in_tool: bool) -> None:
    start, since, button = arm.pose(), arm.system.now, Held(arm)
    for axis in range(3):
        velocity = np.eye(3)[axis] * 0.05
        jogging = jog_linear.asynch(arm, button.svv, velocity=velocity, in_tool=in_tool)
        begin = arm.pose()
        button.run(jogging, 1.0)
        jogging.halt()
        arm.system.advance(1.0)
        assert jogging.wait().condition == "halted"
        way = np.subtract(arm.pose().position, begin.position)
        # The model may have turned the tool's own axes: the displacement is that of one unit vector of the frame.
        direction = velocity / 0.05 if not in_tool else (begin @ gpac.Pose(velocity)).position - np.array(begin.position)
        direction = direction / np.linalg.norm(direction)
        assert way @ direction == pytest.approx(0.05, abs=0.006)
        assert np.linalg.norm(way - (way @ direction) * direction) < 1e-4
        assert arm.pose().angle(start) < 1e-3
    rows = setpoints(arm, since)
    check_limits(arm, rows)
    tool = places(arm, rows)
    speeds = np.linalg.norm(np.diff(tool, axis=0), axis=1) / TICK_S
    assert speeds.max() == pytest.approx(0.05, abs=1e-5)
    assert np.count_nonzero(np.abs(speeds - 0.05) < 1e-5) > 3 * 35, "most of the way at that speed"


def test_a_step_goes_its_distance_and_a_turn_stays_in_place(arm: gpac.robots.Arm) -> None:
    start, button = arm.pose(), Held(arm)
    for distance in (0.0001, 0.001, 0.01):
        begin = np.array(arm.pose().position)
        jogging = jog_linear.asynch(arm, button.svv, velocity=[0.0, 0.0, -0.05], distance=distance)
        button.run(jogging, 5.0)
        assert jogging.wait().condition == "arrived"
        arm.system.advance(0.3)
        assert np.subtract(arm.pose().position, begin) == pytest.approx([0.0, 0.0, -distance], abs=2e-5)
    place = arm.pose()
    turning = jog_linear.asynch(arm, button.svv, angular_velocity=[0.0, 0.0, 0.3], in_tool=True, distance=0.2)
    button.run(turning, 5.0)
    assert turning.wait().condition == "arrived"
    arm.system.advance(0.3)
    assert arm.pose().distance(place) < 1e-4 and arm.pose().angle(place) == pytest.approx(0.2, abs=1e-3)
    assert place.angle(start) < 1e-3


def test_a_button_that_is_let_go_brings_it_to_rest_on_its_line(arm: gpac.robots.Arm) -> None:
    start, since, button = np.array(arm.pose().position), arm.system.now, Held(arm)
    jogging = jog_linear.asynch(arm, button.svv, velocity=[0.0, 0.2, 0.0], acceleration=1.0)
    button.run(jogging, 0.6)
    arm.system.advance(1.5)
    assert jogging.wait().condition == "stopped"
    rows = setpoints(arm, since)
    check_limits(arm, rows)
    tool = places(arm, rows)
    assert np.abs((tool - start)[:, [0, 2]]).max() < 1e-6, "it stays on its line while it slows down"
    assert tool[-1][1] - start[1] < 0.6 * 0.2 + 0.25 * 0.2 + 0.06


def test_near_a_singularity_and_at_a_range_it_rests_and_the_way_back_is_free(arm: gpac.robots.Arm) -> None:
    since, button = arm.system.now, Held(arm)
    start = np.array(arm.pose().position)
    out = start / np.linalg.norm(start) * [1, 1, 0]
    jogging = jog_linear.asynch(arm, button.svv, velocity=0.25 * out / np.linalg.norm(out))
    button.run(jogging, 20.0)
    with pytest.raises(JogBlocked, match="near a singularity or at the end of its reach"):
        jogging.wait()
    off = np.cross(np.subtract(arm.pose().position, start), out / np.linalg.norm(out))
    assert np.linalg.norm(off) < 1e-3, "it rests on its line"
    back = jog_linear.asynch(arm, button.svv, velocity=-0.1 * out / np.linalg.norm(out), distance=0.05)
    button.run(back, 5.0)
    assert back.wait().condition == "arrived"
    check_limits(arm, setpoints(arm, since))
    arm.elbow.position_max = float(arm.elbow.commanded.value) + 0.1
    limited = jog_linear.asynch(arm, button.svv, velocity=-0.25 * out / np.linalg.norm(out))
    button.run(limited, 20.0)
    with pytest.raises(JogBlocked, match="joint 'elbow' is at the end of its range"):
        limited.wait()
    assert arm.elbow.commanded.value <= arm.elbow.position_max


def test_directions_speeds_and_overrides_at_random_keep_every_limit(arm: gpac.robots.Arm) -> None:
    draw, button = np.random.default_rng(7), Held(arm)
    for _ in range(6):
        # Well above the floor, and upward more than down: contact is tested elsewhere.
        goal = np.array([0.0, -1.5, 1.2, -1.3, -1.57, 0.0]) + draw.uniform(-0.3, 0.3, 6)
        move_absolute(arm, goal.tolist(), speed="50 %")
        since = arm.system.now
        jogging = jog_linear.asynch(arm, button.svv, velocity=[0.0, 0.0, 0.1])
        for _ in range(12):
            button.run(jogging, draw.uniform(0.05, 0.5))
            if jogging.done:
                break
            velocity, turn = draw.uniform([-0.25, -0.25, -0.1], 0.25), draw.uniform(-1, 1, 3) * draw.integers(2)
            jogging.set(velocity=velocity.tolist(), angular_velocity=turn.tolist())
            arm.override = float(draw.uniform(0.2, 1.0))
        arm.override = 1.0
        if not jogging.done:
            jogging.halt()
        arm.system.advance(1.5)
        assert jogging.done
        check_limits(arm, setpoints(arm, since)[1:])


def test_it_takes_over_from_a_motion_and_is_taken_over() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
    with arm.system, arm.enabled():
        button = Held(arm)
        moving = move_absolute.asynch(arm, [0.5, -1.2, 1.4, -1.7, -1.57, 0.3])
        arm.system.advance(0.5)
        since = arm.system.now
        jogging = jog_linear.asynch(arm, button.svv, velocity=[0.0, 0.0, 0.05])
        button.run(jogging, 1.5)
        assert moving.done and not jogging.done
        assert stop(arm).condition == "stopped" and jogging.done
        check_limits(arm, setpoints(arm, since)[1:], speed="max_speed")


def test_more_than_the_reduced_speed_is_refused(arm: gpac.robots.Arm) -> None:
    button = Held(arm)
    with pytest.raises(gpac.OutOfRange, match=r"velocity"):
        jog_linear(arm, button.svv, velocity=[0.3, 0.0, 0.0])
    with pytest.raises(gpac.OutOfRange, match=r"angular_velocity"):
        jog_linear(arm, button.svv, angular_velocity=[0.0, 2.0, 0.0])
