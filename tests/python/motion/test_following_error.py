# SPDX-License-Identifier: Apache-2.0
"""The message of a following error has everything a person needs: the joint, the error, its limit, the effort, and the values to change."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from axes import late, machine
from opengpac.robots import FollowingError


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("following", clock="virtual", seed=1) as cell:
        yield cell


def stuck(cell: gpac.System, **changes: Any) -> tuple[str, gpac.Group[Any]]:
    """Returns the text of a motion's exception, and its joints. The speed of a loopback part equals its effort: gain 0 keeps it in
    place."""
    about: dict[str, Any] = {"max_following_error": 0.05, "max_effort": 150.0} | changes
    axes = machine(cell, **about)
    with pytest.raises(gpac.Terminated) as ended:
        gpac.motion.move_absolute(axes, 1.0)
    return str(ended.value), axes


def test_a_motion_says_joint_error_limit_effort_and_what_to_change(cell: gpac.System) -> None:
    said, _ = stuck(cell, kp=0.0)
    pattern = (
        r"the verb of device 'axes\.x' ended with 'following_error': joint 'axes\.x' is (0\.05\d*) rad from its commanded position, "
        r"but max_following_error is 0\.05 rad; its servo's effort is 0 of max_effort 150 N\.m \(not saturated\): move with less speed= or "
        r"acceleration=, raise kp= and kd=, or raise max_following_error="
    )
    found = re.search(pattern, said)
    assert found, said
    assert 0.05 < float(found[1]) < 0.06


def test_a_saturated_servo_is_called_so_wherever_the_end_is_told(cell: gpac.System) -> None:
    said, axes = stuck(cell, kp=50.0, max_effort=0.01)
    words = "its servo's effort is 0.01 of max_effort 0.01 N.m (saturated): move with less speed="
    assert words in said
    assert words in cell.alarms["following_error"].text
    assert any(words in entry["text"] for entry in cell.log())
    assert axes[0].state == "fault"


def test_the_exception_has_the_numbers() -> None:
    for servo, returns in (
        (gpac.robots.joint_servo, ("error_limit", "effort", "effort_limit", "time_lost")),
        (gpac.robots.joint_decoupled_servo, ("error_limit", "effort", "effort_limit", "time_lost", "motor_effort", "motor_limit")),
        (gpac.robots.joint_follower, ("error_limit", "time_lost")),
    ):
        end = servo.termination("following_error", "start")
        assert end is not None
        assert (end.raises, end.returns) == (FollowingError, returns)


def test_a_sliding_joint_speaks_of_metres(cell: gpac.System) -> None:
    said, _ = stuck(cell, kp=0.0, units={"rad": "m", "N.m": "N"})
    assert re.search(
        r"is 0\.05\d* m from its commanded position, .*max_following_error is 0\.05 m; its servo's effort is 0 of max_effort 150 N \(", said
    )


def test_a_joint_that_strayed_in_a_gap_that_is_allowed_is_brought_to_rest_too(cell: gpac.System) -> None:
    """The plant continues under its last effort while the servo stands still."""
    rtp = cell.processor("rtp0")
    axes, keep = machine(cell, on=rtp, max_following_error=0.05), late(rtp, 300)
    moving = gpac.motion.move_velocity.asynch(axes, 0.3, time_limit="3 s")
    cell.advance("700 ms")
    keep()
    cell.advance("1 s")
    words = r"0\.(29\d|3)\d* s were lost at once, and 'axes\.[xy]' moved on by more than max_following_error"
    with pytest.raises(gpac.motion.TimeLost, match=words):
        moving.wait()
    assert {joint.state for joint in axes} == {"standstill"}


def test_a_joint_that_cannot_be_held_after_a_gap_is_made_safe_and_the_motion_has_lost_time(cell: gpac.System) -> None:
    """The drive limits the rate of the effort, so it slows down far less than its reference."""
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="1 ms", priority=80)
    rtp.timer("slow", period="20 ms", priority=60)
    plant = rtp.physical_device("plant", gpac.drivers.loopback("x", "y", slew=0.2), exchange=fast)
    about: dict[str, Any] = {"max_acceleration": 4.0, "kp": 50.0, "kd": 0.0, "max_following_error": 0.05}
    axes = gpac.Group("axes", *(gpac.robots.Joint(f"axes.{name}", drive=plant[name], on=fast, **about) for name in "xy")).enable()
    keep = late(rtp, 700)
    moving = gpac.motion.move_velocity.asynch(axes, 0.3, acceleration=0.1, time_limit="9 s")
    cell.advance("4 s")
    keep()
    cell.advance("2 s")
    with pytest.raises(gpac.motion.TimeLost) as ended:
        moving.wait()
    assert ended.value.value == pytest.approx(0.7, abs=0.02)
    said = str(ended.value)
    words = r"'following_error': joint 'axes\.[xy]' is 0\.05\d* rad from its commanded position, .*; 0\.(69|7)\d* s had been lost at once"
    assert re.search(words, said), said
    assert "have come to rest" not in said
    assert "fault" in {joint.state for joint in axes}
    assert "time_lost" not in cell.alarms and "following_error" in cell.alarms


@pytest.mark.parametrize("max_gap", [0.2, 2.0])
def test_the_bound_of_a_gap_is_the_joints(cell: gpac.System, max_gap: float) -> None:
    rtp = cell.processor("rtp0")
    axes, keep = machine(cell, on=rtp, max_following_error=0.5, max_gap=max_gap), late(rtp, 700)
    moving = gpac.motion.move_absolute.asynch(axes, 1.0, speed=0.3)
    cell.advance("700 ms")
    keep()
    cell.advance("5 s")
    if max_gap > 0.7:
        assert moving.wait().condition == "arrived"
    else:
        with pytest.raises(gpac.motion.TimeLost):
            moving.wait()


def test_a_drive_that_closes_the_loop_has_no_effort_to_tell(cell: gpac.System) -> None:
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="1 ms", priority=80)
    rtp.timer("slow", period="20 ms", priority=60)
    plant = rtp.physical_device("plant", gpac.drivers.loopback("x", command="position"), exchange=fast)
    # The drive lags by one release, which is more than this joint allows.
    axes = gpac.Group("axes", gpac.robots.Joint("axes.x", drive=plant["x"], on=fast, max_following_error=1e-4)).enable()
    with pytest.raises(gpac.Terminated) as ended:
        gpac.motion.move_absolute(axes, 1.0)
    assert "but max_following_error is 0.0001 rad: move with less speed= or acceleration=, find what blocks" in str(ended.value)
    assert "torque limit of its drive" in str(ended.value)


def test_a_servo_that_swings_is_unstable_and_its_joint_in_fault(cell: gpac.System) -> None:
    axes = machine(cell, kp=3000.0, max_effort=20.0)
    with pytest.raises(gpac.Terminated) as ended:
        gpac.motion.move_absolute(axes, 1.0)
    found = re.search(r"the servo of joint 'axes\.([xy])' is unstable: it oscillates at ([\d.]+) Hz: lower kd= and kp=, ", str(ended.value))
    assert found, str(ended.value)
    joint = axes[0 if found[1] == "x" else 1]
    assert joint.state == "fault"
    assert "it oscillates at" in cell.alarms["servo_unstable"].text
    # The positions of the last 20 ms turn like this, that is, over ten periods of the fastest oscillation.
    steps = np.sign(np.diff(joint.sensed.history[-21:]["value"]))
    assert float(found[2]) == pytest.approx(1000 * np.count_nonzero(np.diff(steps)) / 2 / 19, rel=0.2)


def test_a_servo_that_saturates_both_ways_in_a_motion_is_not_unstable(cell: gpac.System) -> None:
    axes = machine(cell, kp=50.0, max_effort=1.0, max_following_error=0.0)
    for goal in (0.5, -0.5) * 4:
        gpac.motion.move_absolute(axes, goal, speed="100 %")
    assert axes[0].state == "standstill"


def test_the_check_can_be_turned_off(cell: gpac.System) -> None:
    axes = machine(cell, kp=3000.0, max_effort=20.0, unstable_from=0.0)
    gpac.motion.move_absolute.asynch(axes, 1.0)
    cell.advance("1 s")
    assert axes[0].state == "moving"


def test_a_position_that_ripples_is_unstable_though_its_effort_is_within_its_limits(cell: gpac.System) -> None:
    axes = machine(cell, kp=2020.0, max_effort=1e6)
    with pytest.raises(gpac.Terminated, match="is unstable: it oscillates at 500 Hz"):
        gpac.motion.move_absolute(axes, 1.0)


@pytest.mark.parametrize("error", [0.1, 0.0])
def test_a_ripple_at_rest_is_unstable_though_it_is_far_from_every_other_limit(cell: gpac.System, error: float) -> None:
    """At this gain a loopback part overshoots by half a per cent more than its error, at each sample."""
    joint = machine(cell, kp=2005.0, max_effort=1e6, max_following_error=error, max_ripple=1e-3)[0]
    gpac.motion.move_absolute(joint, 0.1)
    cell.advance("4 s")
    assert joint.state == "fault"
    assert "the servo of joint 'axes.x' is unstable: it oscillates at 500 Hz" in cell.alarms["servo_unstable"].text
    assert 1e-3 < np.ptp(joint.sensed.history[:]["value"][-20:]) < 2e-3


def test_the_check_of_the_ripple_can_be_turned_off(cell: gpac.System) -> None:
    joint = machine(cell, kp=2005.0, max_effort=1e6, max_ripple=0.0)[0]
    gpac.motion.move_absolute(joint, 0.1)
    cell.advance("2.5 s")
    assert np.ptp(joint.sensed.history[-20:]["value"]) > 1e-3 and joint.state == "standstill"


def test_the_bound_of_the_ripple_follows_the_unit_and_the_noise_of_the_readings() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual")
    assert {joint.max_ripple for joint in arm} == {1e-3}, "a simulated arm has no noise"
    with gpac.System("real", clock="virtual") as cell:
        assert machine(cell)[0].max_ripple == 4e-3


@pytest.mark.parametrize(
    "soft",
    [{"kp": 10.0, "max_effort": 100.0, "max_following_error": 0.35}, {"kp": 50.0, "max_effort": 1.0, "max_following_error": 0.0}],
    ids=["error", "effort"],
)
def test_a_joint_that_is_commanded_to_swing_is_not_unstable(cell: gpac.System, soft: dict[str, float]) -> None:
    joint = machine(cell, max_speed=100.0, **soft)[0]
    for k in range(300):
        joint.commanded.value = 0.3 * math.sin(2 * math.pi * 10.0 * k * 0.01)
        cell.advance("10 ms")
    assert "servo_unstable" not in cell.alarms
