# SPDX-License-Identifier: Apache-2.0
"""Motion at a velocity, stop, jog, override, hold and gear: every change is smooth at 1 ms."""

from __future__ import annotations

import numpy as np
import pytest

import opengpac as gpac
from axes import Watch
from opengpac import motion
from opengpac.robots import Joint


def test_a_velocity_is_kept_changed_and_stopped_smoothly(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    moving = motion.move_velocity.asynch(axes, [0.5, "-50 %"])
    watch.run(600)
    assert axes.values("commanded_velocity") == pytest.approx([0.5, -0.5])
    moving.set(velocity=[-0.2, 0.1])
    watch.run(800)
    assert axes.values("commanded_velocity") == pytest.approx([-0.2, 0.1])
    with pytest.raises(gpac.OutOfRange, match=r"'velocity' for 'axes.x' is 3 rad/s, but its range is -1 to 1 rad/s"):
        moving.set(velocity=[3.0, 0.0])
    moving.halt()
    watch.run(400)
    assert axes.values("commanded_velocity") == [0.0, 0.0]
    report = moving.wait()
    assert list(report.position) == pytest.approx(axes.values("commanded"))
    watch.smooth()


def test_a_joint_stops_before_the_end_of_its_range(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    with pytest.raises(motion.LimitReached):
        watch.wait(motion.move_velocity.asynch(axes, [1.0, 0.1]))
    watch.smooth()
    assert axes[0].reference.value == 2.0 and axes[0].limited.value == 0
    # From there only a motion back is possible.
    with pytest.raises(motion.LimitReached):
        motion.move_velocity(axes[0], 0.3)
    motion.move_velocity(axes[0], -0.3, time_limit="1 s")
    assert axes[0].reference.value < 1.8


def test_jog_stops_when_nobody_holds_the_button(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    button = axes.system.svv("button", int)
    jogging = motion.jog.asynch(axes, button, velocity=[0.2, 0.0])
    for beat in range(1, 21):
        button.value = beat
        watch.run(50)
        assert not jogging.done
    watch.run(400, until=lambda: jogging.done)
    assert jogging.wait().condition == "stopped"
    watch.run(100).smooth()
    assert axes.values("commanded_velocity") == [0.0, 0.0] and axes[0].reference.value == pytest.approx(0.24, abs=0.03)
    with pytest.raises(gpac.OutOfRange, match=r"jog_speed"):
        motion.jog(axes, button, velocity=0.5)


def test_beats_of_another_client_do_not_keep_a_jog_going(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    button = axes.system.svv("button", int)
    button.value = 7 << 20
    jogging = motion.jog.asynch(axes[0], button, velocity=0.2, client=7)
    other = motion.jog.asynch(axes[1], button, velocity=0.2, client=8)
    for beat in range(1, 11):
        for client in (7, 8):
            button.value = (client << 20) + beat
            watch.run(40)
    assert not jogging.done and not other.done
    # The first client has gone; the second one still writes.
    for beat in range(11, 21):
        button.value = (8 << 20) + beat
        watch.run(40)
    assert jogging.wait().condition == "stopped" and axes[0].commanded_velocity.value == 0.0
    assert not other.done
    other.halt()
    watch.run(400).smooth()


def test_stop_is_a_verb_that_ends_at_rest(axes: gpac.Group[Joint]) -> None:
    report = motion.stop(axes, deceleration="50 %")
    assert report.condition == "stopped" and list(report.position) == [0.0, 0.0]


def test_override_scales_the_speed_of_the_group_and_of_the_cell(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    moving = motion.move_absolute.asynch(axes, [1.8, 0.9], speed="100 %")
    watch.run(500)
    axes.override = 0.5
    watch.run(400)
    assert axes[0].commanded_velocity.value == pytest.approx(0.5)
    axes.system.override = 0.5
    watch.run(400)
    assert axes[0].commanded_velocity.value == pytest.approx(0.25)
    assert (axes.override, axes.system.override, axes[1].cell_override.value) == (0.5, 0.5, 0.5)
    axes.system.override = 0.0
    watch.run(400)
    held = axes.values("reference")
    assert axes.values("commanded_velocity") == [0.0, 0.0] and not moving.done
    watch.run(200)
    assert axes.values("reference") == held
    axes.system.override = 1.0
    assert watch.wait(moving).condition == "arrived"
    watch.smooth()
    path = watch.path
    assert np.abs(path[:, 0] - 2 * path[:, 1]).max() < 1e-9, "it stays on its line"


def test_an_override_is_between_0_and_1(axes: gpac.Group[Joint]) -> None:
    for wrong in (1.5, -0.1):
        with pytest.raises(gpac.OutOfRange, match=r"its range is 0 to 1"):
            axes.override = wrong
        with pytest.raises(gpac.OutOfRange, match=r"its range is 0 to 1"):
            axes.system.override = wrong
    assert axes.override == 1.0
    with gpac.System("empty", clock="virtual") as empty:
        assert empty.override == 1.0
        empty.override = 0.25
        assert empty.override == 0.25


def test_gear_couples_an_axis_to_another(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    geared = motion.gear.asynch(axes[1], axes[0].commanded, ratio=-0.5)
    watch.run(100)
    move = motion.move_absolute.asynch(axes[0], 1.0, speed="60 %", acceleration="40 %")
    watch.run(700)
    relation = axes[1].commanded.value + 0.5 * axes[0].commanded.value
    while not move.done:
        watch.run(20)
        assert axes[1].commanded.value + 0.5 * axes[0].commanded.value == pytest.approx(relation, abs=0.02)
    watch.run(100)
    assert axes[1].commanded.value == pytest.approx(-0.5, abs=0.02)
    moving = motion.move_velocity.asynch(axes[0], -0.8)
    watch.run(500)
    assert axes[1].commanded_velocity.value == pytest.approx(0.4)
    geared.halt()
    watch.run(400)
    assert axes[1].commanded_velocity.value == 0.0
    moving.halt()
    watch.run(400).smooth()


@pytest.mark.parametrize("ratio", [1.0, -1.0])
def test_a_gear_stops_before_the_end_of_the_range_and_says_so(axes: gpac.Group[Joint], ratio: float) -> None:
    watch = Watch(axes)
    geared = motion.gear.asynch(axes[1], axes[0].commanded, ratio=2.0 * ratio)
    driving = motion.move_velocity.asynch(axes[0], 0.45)
    with pytest.raises(motion.LimitReached):
        watch.wait(geared)
    assert 1.8 < ratio * axes[1].commanded.value <= 2.0
    assert axes[1].commanded_velocity.value == 0.0
    assert axes[1].limited.value == 0
    driving.halt()
    watch.run(400).smooth()


def test_a_gear_that_would_be_too_fast_stops_and_says_so(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    geared = motion.gear.asynch(axes[1], axes[0].commanded, ratio=2.0)
    driving = motion.move_velocity.asynch(axes[0], 0.6)
    with pytest.raises(motion.LimitReached):
        watch.wait(geared)
    assert abs(axes[1].commanded.value) < 1.0
    assert axes[1].commanded_velocity.value == 0.0
    driving.halt()
    watch.run(400).smooth()
