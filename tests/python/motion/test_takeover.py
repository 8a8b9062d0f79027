# SPDX-License-Identifier: Apache-2.0
"""Two motions of one arm: the second takes over smoothly, or waits its turn, as the arm declares."""

from __future__ import annotations

import numpy as np
import pytest

import opengpac as gpac
from opengpac import motion


def goal(arm: gpac.robots.Arm, *by: float) -> list[float]:
    """The present positions, the first joints moved by so much."""
    present = [float(q) for q in arm.values("sensed")]
    return [q + step for q, step in zip(present, [*by, *[0.0] * (len(present) - len(by))], strict=True)]


def test_a_stop_takes_over_a_running_move_within_the_limits() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
    with arm.system as cell, arm.enabled():
        moving = motion.move_absolute.asynch(arm, goal(arm, 0.8, 0.0, -0.4, 0.5), speed="60 %")
        cell.advance("500 ms")
        assert motion.stop(arm).condition == "stopped"
        assert moving.report.condition == "aborted"
        reference = np.array([joint.reference.history[:]["value"][-900:] for joint in arm]).T
        speed = np.diff(reference, axis=0) / 1e-3
        limits = np.array([joint.max_acceleration for joint in arm])
        assert np.abs(speed).max() > 1.0, "it moved when it was stopped"
        assert (np.abs(np.diff(speed, axis=0) / 1e-3) <= limits * (1 + 1e-6)).all()


def test_what_a_takeover_leaves_behind_comes_to_rest_within_the_limits() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
    with arm.system as cell, arm.enabled():
        moving = motion.move_absolute.asynch(arm, goal(arm, 0.8, 0.0, -0.4, 0.5), speed="60 %")
        cell.advance("500 ms")
        assert abs(arm["shoulder_pan"].commanded_velocity.value) > 0.5
        assert motion.move_relative(arm["wrist_3"], 0.2).condition == "arrived"
        assert moving.report.condition == "aborted"
        assert arm["shoulder_pan"].commanded_velocity.value == 0.0
        reference = np.array([joint.reference.history[:]["value"][-900:] for joint in arm]).T
        change = np.abs(np.diff(reference, 2, axis=0) / 1e-6)
        limits = np.array([joint.max_acceleration for joint in arm])
        assert (change <= limits * (1 + 1e-6)).all(), f"{change.max()} rad/s²"


def test_moves_of_a_queue_run_one_after_the_other() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="queue")
    with arm.system, arm.enabled():
        there, back = goal(arm, 0.3), goal(arm)
        first, second = motion.move_absolute.asynch(arm, there), motion.move_absolute.asynch(arm, back)
        assert (first.state, second.state) == ("running", "queued")
        assert second.wait().position == pytest.approx(back, abs=0.005)
        assert first.report.position == pytest.approx(there, abs=0.005)


def test_a_second_move_is_refused_where_nothing_is_declared() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual")
    with arm.system, arm.enabled():
        motion.move_absolute.asynch(arm, goal(arm, 0.3))
        with pytest.raises(gpac.SecondWriter, match=r"move_absolute#1"):
            motion.move_absolute(arm, goal(arm, -0.3))


def test_a_suspended_move_comes_to_rest_and_goes_on() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual")
    with arm.system as cell, arm.enabled():
        moving = motion.move_absolute.asynch(arm, goal(arm, 0.5), speed="50 %")
        cell.advance("300 ms")
        moving.suspend()
        held = arm[0].commanded.value
        cell.advance("200 ms")
        assert (arm[0].commanded.value, arm[0].commanded_velocity.value) == (held, 0.0)
        moving.resume()
        assert moving.wait().condition == "arrived"
        speed = np.diff(arm[0].reference.history[:]["value"]) / 1e-3
        assert np.abs(np.diff(speed) / 1e-3).max() <= arm[0].max_acceleration * (1 + 1e-6)
