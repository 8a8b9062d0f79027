# SPDX-License-Identifier: Apache-2.0
"""A motion that is already decelerating is not stopped abruptly by a suspension, a first halt or its time limit: it comes to rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from axes import Watch
from opengpac import motion
from opengpac.robots import Joint

Axes = gpac.Group[Joint]
MOTIONS: dict[str, Callable[[Axes], gpac.VerbInstance[Any]]] = {
    "move_absolute": lambda axes: motion.move_absolute.asynch(axes, 1.8, speed="100 %", time_limit="0.6 s"),
    "move_velocity": lambda axes: motion.move_velocity.asynch(axes, 1.0, time_limit="0.6 s"),
    "follow": lambda axes: motion.follow.asynch(axes, [[0.9, 0.9], [1.8, 1.8]], speed=1.0, time_limit="0.6 s"),
}
ENDS = {"move_absolute": "timed_out", "move_velocity": "stopped", "follow": "timed_out"}


def speed(axes: Axes) -> float:
    """Returns the commanded speed of the axes."""
    return max(abs(of) for of in axes.values("commanded_velocity"))


def slowing(axes: Axes, of: str) -> tuple[Watch, gpac.VerbInstance[Any]]:
    """Returns a motion whose time limit has passed, and which is decelerating."""
    watch = Watch(axes)
    moving = MOTIONS[of](axes)
    watch.run(680)
    place = [axis.reference.history[-2:]["value"] for axis in axes]
    assert not moving.done and all(after - before > 0.3e-3 for before, after in place), "it still moves"
    return watch, moving


@pytest.mark.parametrize("of", MOTIONS)
def test_a_motion_whose_time_is_up_comes_to_rest_when_it_is_suspended(axes: Axes, of: str) -> None:
    watch, moving = slowing(axes, of)
    moving.suspend()
    assert moving.done and moving.report.condition == ENDS[of], "it was on its way to its end"
    watch.run(200).smooth()
    assert speed(axes) == 0.0


@pytest.mark.parametrize("of", MOTIONS)
def test_a_motion_whose_time_is_up_comes_to_rest_when_it_is_halted(axes: Axes, of: str) -> None:
    watch, moving = slowing(axes, of)
    moving.halt()
    watch.run(300).smooth()
    assert moving.report.condition == "halted"


def test_the_time_limit_lets_a_motion_come_to_rest_that_is_halted_or_being_suspended(axes: Axes) -> None:
    watch = Watch(axes)
    moving = motion.move_velocity.asynch(axes, 1.0, time_limit="0.6 s")
    watch.run(550)
    moving.suspend()
    watch.run(200).smooth()
    assert moving.done and speed(axes) == 0.0


def test_one_that_ended_while_it_was_being_suspended_moves_when_it_is_started_again(axes: Axes) -> None:
    moving = motion.move_velocity.new_instance(axes)
    for way in (0.3, -0.3):
        moving.start(velocity=way, time_limit="0.3 s")
        axes.system.advance("320 ms")
        assert abs(speed(axes)) > 0.05
        moving.suspend()
        assert moving.done and speed(axes) == 0.0
    assert abs(axes[0].commanded.value) < 0.02, "there and back"


@pytest.mark.parametrize("call", ["halt", "suspend", "time limit"])
def test_a_stop_is_not_cut_short(call: str) -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
    with arm.system as cell, arm.enabled():
        motion.move_velocity.asynch(arm, 1.0)
        cell.advance("500 ms")
        stopping = motion.stop.asynch(arm, **{"time_limit": "60 ms"} if call == "time limit" else {})
        cell.advance("60 ms")
        assert abs(arm[0].commanded_velocity.value) > 0.1
        if call != "time limit":
            getattr(stopping, call)()
        cell.advance("500 ms")
        assert stopping.done and stopping.report.condition == ("halted" if call == "halt" else "stopped")
        reference = np.array([joint.reference.history[:]["value"][-900:] for joint in arm]).T
        change = np.abs(np.diff(reference, 2, axis=0)) / 1e-6
        limits = np.array([joint.max_acceleration for joint in arm])
        assert (change <= limits * (1 + 1e-6)).all(), f"{change.max()} rad/s²"


def test_a_suspended_search_for_home_slows_down_and_goes_on(unhomed: Axes) -> None:
    watch = Watch(unhomed)
    switch = unhomed.system.svv("switch", bool)
    homing = motion.home.asynch(unhomed[0], switch, speed=0.5)
    watch.run(400)
    assert speed(unhomed) == pytest.approx(0.5)
    homing.suspend()
    assert homing.state == "suspended" and speed(unhomed) == 0.0
    watch.run(100)
    homing.resume()
    watch.run(400)
    assert speed(unhomed) == pytest.approx(0.5)
    homing.halt()
    watch.run(300).smooth()
    assert homing.report.condition == "halted"
