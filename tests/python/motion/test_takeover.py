# SPDX-License-Identifier: Apache-2.0
"""Two motions of one arm: the second takes over smoothly, or waits its turn, as the arm declares.

Each pair of motions is tried at one of its instants, a different one each day; `OPENGPAC_TAKEOVERS_AT=all` tries all of them, and
`OPENGPAC_SEED` selects the day.
"""

from __future__ import annotations

import datetime
import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from opengpac import motion

DAY = int(os.environ.get("OPENGPAC_SEED", datetime.date.today().toordinal()))


def of_the_day(instants: Sequence[Any], place: int) -> Sequence[Any]:
    """Returns the one of these instants at which the pair at a place is tried today, or all of them. Neighbours have different ones."""
    if os.environ.get("OPENGPAC_TAKEOVERS_AT") == "all":
        return instants
    at = (DAY + place) % len(instants)
    return instants[at : at + 1]


def goal(arm: gpac.robots.Arm, *by: float) -> list[float]:
    """Returns the present positions, with the first joints displaced by `by`."""
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


def by(joint: int, way: float) -> list[float]:
    return [way if i == joint else 0.0 for i in range(6)]


def on_a_line(arm: gpac.robots.Arm, x: float, y: float, z: float) -> gpac.VerbInstance[Any]:
    return motion.move_linear.asynch(arm, gpac.Pose((x, y, z)) @ arm.pose(), speed=0.2)


MOTIONS: dict[str, Callable[[gpac.robots.Arm, float], gpac.VerbInstance[Any]]] = {
    "joints": lambda arm, to: motion.move_absolute.asynch(arm, goal(arm, 0.6 * to, 0.0, 0.3 * to), speed="40 %", acceleration="50 %"),
    "velocity": lambda arm, to: motion.move_velocity.asynch(arm, by(0, to), time_limit="0.4 s"),
    "line": lambda arm, to: on_a_line(arm, 0.1 * to, -0.1, 0.05),
    "path": lambda arm, to: motion.follow.asynch(arm, [goal(arm, 0.2 * to, 0.1), goal(arm, 0.3 * to)]),
    "line of several": lambda arm, to: motion.follow_linear.asynch(
        arm, [gpac.Pose((0.05 * to, -0.05, 0.0)) @ arm.pose(), arm.pose()], speed=0.2
    ),
    "robots.move": lambda arm, to: gpac.robots.move.asynch(arm, goal(arm, 0.4 * to)),
    "stop": lambda arm, _: motion.stop.asynch(arm),
}


@pytest.mark.parametrize("second", MOTIONS)
@pytest.mark.parametrize("first", [name for name in MOTIONS if name != "stop"])
def test_every_motion_takes_over_every_other_within_the_limits(first: str, second: str) -> None:
    """The second motion starts at an instant of each phase: acceleration, constant speed, deceleration; in the opposite direction or the
    same."""
    place = list(MOTIONS).index(first) + list(MOTIONS).index(second)
    for when, to in of_the_day((("107 ms", -1.0), ("320 ms", -1.0), ("320 ms", 1.0)), place):
        arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
        with arm.system as cell, arm.enabled():
            moving = MOTIONS[first](arm, 1.0)
            cell.advance(when)
            then = MOTIONS[second](arm, to)
            assert moving.report.condition == "aborted"
            assert then.wait().condition in ("arrived", "stopped")
            reference = np.array([joint.reference.history[:]["value"] for joint in arm]).T
            change = np.abs(np.diff(reference, 2, axis=0)) / 1e-6
            limits = np.array([joint.max_acceleration for joint in arm])
            assert (change <= limits * 1.02).all(), f"{change.max()} rad/s² when '{second}' takes over '{first}' after {when}"


AWAY: dict[str, tuple[gpac.Verb[..., Any], Callable[[gpac.robots.Arm], dict[str, Any]]]] = {
    "joints": (motion.move_absolute, lambda arm: {"goal": goal(arm, 0.6, 0.0, 0.3), "speed": "40 %"}),
    "velocity": (motion.move_velocity, lambda arm: {"velocity": by(0, 1.0)}),
    "jog": (motion.jog, lambda arm: {"heartbeat": arm.system.svv("button", int), "velocity": "100 %"}),
    "line": (motion.move_linear, lambda arm: {"pose": gpac.Pose((0.1, -0.1, 0.05)) @ arm.pose(), "speed": 0.2}),
    "path": (motion.follow, lambda arm: {"points": [goal(arm, 0.2, 0.1), goal(arm, 0.3)]}),
    "line of several": (
        motion.follow_linear,
        lambda arm: {"poses": [gpac.Pose((0.05, -0.05, 0.0)) @ arm.pose(), arm.pose()], "speed": 0.2},
    ),
    "robots.move": (gpac.robots.move, lambda arm: {"goal": goal(arm, 0.4)}),
}
"""Motions that may be a part, and their inputs."""


def taken_away(arm: gpac.robots.Arm, name: str, when_s: float) -> None:
    """Ends a motion by the end of another part after `when_s`: its generators stop writing, and nothing decelerates it."""
    part, inputs = AWAY[name]
    clock = gpac.Verb(
        "clock",
        blocks={"clock": gpac.library.time_limit(limit=when_s)},
        command_lists={"start": [gpac.activate("clock", every="1 ms")]},
        conditions={"over": gpac.on("clock.expired", returns=[])},
    )
    report = gpac.together({"part": part, "clock": clock}, name="taken_away")(arm, **inputs(arm))
    assert report.condition == "over"


def check(arm: gpac.robots.Arm, told: str) -> None:
    """Checks that the references of all joints kept to speed, acceleration and range at 1 ms."""
    for joint in arm:
        reference = joint.reference.history[:]["value"]
        assert np.abs(np.diff(reference)).max() / 1e-3 <= joint.max_speed * (1 + 1e-6), f"{joint.short_name}: {told}"
        change = np.abs(np.diff(reference, 2)).max() / 1e-6
        assert change <= joint.max_acceleration * 1.02, f"{joint.short_name}: {change} rad/s² {told}"
        assert joint.position_min <= reference.min() and reference.max() <= joint.position_max


@pytest.mark.parametrize("after", [1, 33, 2000])
@pytest.mark.parametrize("name", AWAY)
def test_a_motion_that_is_taken_away_is_braked_and_the_next_one_begins_from_there(name: str, after: int) -> None:
    """The motion is ended during acceleration and at constant speed; the next one begins at once, while the servo brakes, or at rest."""
    for index, (second, to) in enumerate((name, -1.0) for name in MOTIONS if after == 33 or name in ("joints", "line")):
        for when_s in of_the_day((0.107, 0.15), list(AWAY).index(name) + index):
            arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
            with arm.system as cell, arm.enabled():
                taken_away(arm, name, when_s)
                cell.advance(f"{after} ms")
                told = f"when '{name}' is taken away after {when_s} s and '{second}' begins {after} ms later"
                if after == 2000:
                    rests = np.array([joint.reference.value for joint in arm])
                    last = np.array(arm.values("commanded"))
                    beyond = np.array([joint.braking.value[0] for joint in arm])
                    assert np.abs(rests - last - beyond).max() < 1e-12 and np.abs(beyond).max() > 1e-3
                assert MOTIONS[second](arm, to).wait().condition in ("arrived", "stopped")
                check(arm, told)
                assert all(joint.braking.value[3] == 0 for joint in arm), "the next one leads"


@pytest.mark.parametrize("when", ["47 ms", "81 ms", "120 ms", "200 ms", "320 ms"])
@pytest.mark.parametrize("how", ["halt", "stop", "back", "robots.move back", "suspend"])
def test_jerk_is_kept_whatever_ends_a_motion_that_speeds_up(how: str, when: str) -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
    with arm.system as cell, arm.enabled():
        start = goal(arm)
        moving = motion.move_absolute.asynch(arm, goal(arm, 0.8, 0.2, -0.4), speed="60 %")
        cell.advance(when)
        if how in ("halt", "suspend"):
            getattr(moving, how)()
        elif how == "stop":
            motion.stop(arm)
        elif how == "back":
            motion.move_absolute(arm, start, speed="100 %")
        else:
            gpac.robots.move(arm, start)
        cell.advance("300 ms")
        for joint in arm:
            rows = joint.commanded.history[:]
            assert (np.diff(rows["time"][3:]) < 0.0201).all()
            jerk = np.abs(np.diff(rows["value"], 3)) / 0.02**3
            assert jerk.max() <= joint.max_jerk * (1 + 1e-6), f"{joint.short_name}: {jerk.max()} rad/s³"


def test_a_line_that_is_refused_leaves_a_moving_arm_at_rest_within_its_limits() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
    with arm.system as cell, arm.enabled():
        motion.move_absolute.asynch(arm, goal(arm, 0.8), speed="60 %")
        cell.advance("300 ms")
        with pytest.raises(motion.LineRefused, match="out of reach"):
            motion.move_linear(arm, gpac.Pose((3.0, 0.0, 0.0)) @ arm.pose())
        cell.advance("200 ms")
        reference = arm[0].reference.history[:]["value"]
        assert np.abs(np.diff(reference, 2)).max() / 1e-6 <= arm[0].max_acceleration * (1 + 1e-6)
        assert arm[0].commanded_velocity.value == 0.0


@pytest.mark.parametrize("how", ["halt", "suspend", "time limit"])
def test_a_line_that_brakes_what_moved_before_may_be_ended_too(how: str) -> None:
    arm = gpac.robots.load("ur5e", clock="virtual", arbitration="abort")
    with arm.system as cell, arm.enabled():
        motion.move_absolute.asynch(arm, goal(arm, 0.8), speed="60 %")
        cell.advance("300 ms")
        limit = {"time_limit": "60 ms"} if how == "time limit" else {}
        line = motion.move_linear.asynch(arm, gpac.Pose((0.0, 0.0, 0.05)) @ arm.pose(), **limit)
        cell.advance("60 ms")
        if how != "time limit":
            getattr(line, how)()
        cell.advance("500 ms")
        assert arm[0].commanded_velocity.value == 0.0
        reference = arm[0].reference.history[:]["value"]
        assert np.abs(np.diff(reference, 2)).max() / 1e-6 <= arm[0].max_acceleration * (1 + 1e-6)
        if how == "suspend":
            line.resume()
            assert line.wait().condition == "arrived"
        else:
            assert line.done and line.report.condition == ("halted" if how == "halt" else "timed_out")
