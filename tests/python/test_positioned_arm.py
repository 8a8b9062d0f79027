# SPDX-License-Identifier: Apache-2.0
"""An arm whose drives take positions: every motion is the same as with servos that run here, and no position jumps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opengpac as gpac


@pytest.fixture
def arm() -> Iterator[gpac.robots.Arm]:
    driver = gpac.drivers.loopback("shoulder", "elbow", initial=[0.3, -0.2], command="position")
    arm = gpac.robots.load("two_joint", driver=driver, clock="virtual")
    yield arm.enable()
    arm.system.close()


def commanded_steps(joint: gpac.robots.Joint) -> np.ndarray:
    """Returns the step of the joint's reference in each invocation of its follower."""
    return np.abs(np.diff(joint.reference.history[:]["value"]))


def test_motions_are_as_with_an_arm_that_takes_efforts(arm: gpac.robots.Arm) -> None:
    assert arm.shoulder.verb is gpac.robots.joint_follower and arm.shoulder.definition_name() == "robot_joint"
    assert gpac.robots.move(arm, goal=[0.5, 0.1], speed=0.5).position == pytest.approx([0.5, 0.1], abs=2e-3)
    assert gpac.motion.move_absolute(arm, [0.2, 0.4]).position == pytest.approx([0.2, 0.4], abs=2e-3)
    vi = gpac.motion.move_velocity.asynch(arm.elbow, "20 %")
    arm.system.advance("0.3 s")
    vi.halt()
    assert arm.elbow.velocity.value == pytest.approx(0.0, abs=1e-3)


def test_it_begins_where_it_is_and_keeps_to_its_speed(arm: gpac.robots.Arm) -> None:
    arm.system.advance("0.1 s")
    assert (arm.shoulder.sensed.value, arm.elbow.sensed.value) == pytest.approx((0.3, -0.2), abs=1e-12)
    gpac.motion.move_absolute(arm, [1.0, -1.0], speed="100 %")
    for joint in arm:
        assert commanded_steps(joint).max() <= joint.max_speed * 1e-3 * (1 + 1e-9)


def test_a_pause_and_another_enabling_make_no_leap(arm: gpac.robots.Arm) -> None:
    vi = gpac.motion.move_absolute.asynch(arm, [1.0, 0.5], speed="50 %")
    arm.system.advance("0.3 s")
    vi.suspend()
    vi.resume()
    arm.system.advance("0.1 s")
    vi.halt()
    vi.delete()
    before = arm.values("sensed")
    arm.disable()
    arm.enable()
    arm.system.advance("0.1 s")
    assert arm.values("sensed") == pytest.approx(before, abs=1e-9)
    for joint in arm:
        assert commanded_steps(joint).max() <= joint.max_speed * 1e-3 * (1 + 1e-9)


def test_a_slower_timer_runs_the_followers_at_its_pace() -> None:
    cell = gpac.System("slower", clock="virtual")
    rtp = cell.processor("rtp0")
    rtp.timer("slow", period="20 ms", priority=60)
    on = rtp.timer("fast", period="2 ms", priority=80)
    driver = gpac.drivers.loopback("shoulder", "elbow", command="position")
    arm = gpac.robots.load("two_joint", on=on, driver=driver).enable()
    assert gpac.robots.move(arm, goal=[0.4, 0.1], speed=0.5).position == pytest.approx([0.4, 0.1], abs=2e-3)
    assert commanded_steps(arm.shoulder).max() <= 0.5 * 2e-3 * 1.2
    cell.close()


def drive(period: str = "1 ms", **options: Any) -> gpac.PhysicalDevice:
    """Returns a loopback device with a part `x`."""
    rtp = gpac.System("axes", clock="virtual").processor("rtp0")
    return rtp.physical_device("line", gpac.drivers.loopback("x", **options), exchange=rtp.timer("fast", period, 80))


def test_a_joint_by_itself_is_kept_going_as_its_drive_asks_for() -> None:
    line = drive("5 ms", command="position")
    joint = gpac.robots.Joint("j", drive=line["x"], max_speed=0.5).enable()
    assert joint.verb is gpac.robots.joint_follower
    assert (joint.max_speed, joint.jog_speed, joint.max_effort) == (0.5, 0.25, 1e6)
    assert gpac.motion.move_absolute(gpac.Group("j", joint), [0.2]).position == pytest.approx([0.2], abs=2e-3)
    assert commanded_steps(joint).max() <= 0.5 * 5e-3 * (1 + 1e-9)
    line.system.close()


def test_a_joint_by_itself_has_the_gains_of_its_drive_and_a_verb_that_it_is_given() -> None:
    line = drive()
    joint = gpac.robots.Joint("j", drive=line["x"])
    assert (joint.verb, joint.kp, joint.kd) == (gpac.robots.joint_servo, 50.0, 0.0)
    joint.delete()
    assert gpac.robots.Joint("j", drive=line["x"], verb=gpac.robots.joint_servo, kp=20.0).kp == 20.0
    line.system.close()


def test_a_verb_that_the_drive_does_not_suit_is_refused() -> None:
    line = drive(command="position")
    wanted = (
        r"verb 'robot_joint_servo' cannot servo joint 'j': it needs channel 'bias' of part 'line.x', "
        r"whose written channels are 'goal'; omit verb= to use 'robot_joint_follower'"
    )
    with pytest.raises(gpac.CallError, match=wanted):
        gpac.robots.Joint("j", drive=line["x"], verb=gpac.robots.joint_servo)
    line.system.close()


@pytest.mark.parametrize("missing", [("motor_effort",), ("motor_limit",), ("motor_effort", "motor_limit")])
def test_a_drive_that_does_not_tell_its_motor_is_kept_going_and_the_message_says_less(missing: tuple[str, ...]) -> None:
    model = Path(gpac.robots.__file__).with_name("two_joint.xml")
    with gpac.System("quiet", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        line = rtp.physical_device("line", gpac.drivers.mujoco(model), exchange=rtp.timer("fast", "1 ms", 80))
        for channel in missing:
            del line.channels[f"shoulder.{channel}"]
        joint = gpac.robots.Joint("j", drive=line["shoulder"]).enable()
        other = gpac.robots.Joint("other", drive=line["elbow"]).enable()
        assert other.verb is gpac.robots.joint_decoupled_servo and joint.kp == line["shoulder"].about["decoupled"]["kp"]
        both = gpac.Group("both", joint, other)
        assert gpac.motion.move_absolute(both, [0.2, 0.1]).position == pytest.approx([0.2, 0.1], abs=2e-3)
        joint.disable()
        joint.max_following_error = 1e-6
        joint.enable()
        with pytest.raises(gpac.Terminated, match=r"; its servo's effort is \S+ of max_effort 60 N\.m") as ended:
            gpac.motion.move_absolute(both, [-0.5, 0.1])
        assert "its motor" not in str(ended.value)


def test_a_part_that_takes_neither_is_refused() -> None:
    line = drive(command="position")
    part = line["x"]
    assert isinstance(part, gpac.Part)
    del line.channels["x.goal"]
    with pytest.raises(gpac.CallError, match=r"needs channel 'goal' of part 'line.x', whose written channels are none; pass a part that"):
        gpac.robots.Joint("j", drive=part)
    line.system.close()
