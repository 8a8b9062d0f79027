# SPDX-License-Identifier: Apache-2.0
"""Lost time is not made up for: after any delay the requested speed is kept, and a gap beyond the joints' bound brings them to rest."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import opengpac as gpac
from axes import ACCELERATION, SPEED, late, machine
from opengpac import activate, motion
from opengpac.robots import Joint

Axes = gpac.Group[Joint]
ASKED = 0.3

MOTIONS: dict[str, Callable[[Axes], gpac.VerbInstance[Any]]] = {
    "move_absolute": lambda axes: motion.move_absolute.asynch(axes, 0.6, speed=ASKED),
    "move_velocity": lambda axes: motion.move_velocity.asynch(axes, ASKED, time_limit="3 s"),
    "follow": lambda axes: motion.follow.asynch(axes, [[0.3, 0.3], [0.6, 0.6]], speed=ASKED),
    "robots.move": lambda axes: gpac.robots.move.asynch(axes, [0.6, 0.6], speed=ASKED),
    "gear": lambda axes: motion.gear.asynch(axes[0], axes[1].commanded, time_limit="3 s"),
}


@pytest.fixture(params=[50, 100, 300, 480])
def bounded(request: pytest.FixtureRequest) -> Iterator[tuple[Axes, Callable[[], None]]]:
    """Yields two axes, and a function that makes a gap within their bound."""
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        yield machine(cell, on=rtp), late(rtp, request.param)


@pytest.mark.parametrize("of", MOTIONS)
@pytest.mark.parametrize("after", ["90 ms", "700 ms", "1.91 s"])
def test_the_speed_asked_for_is_kept(bounded: tuple[Axes, Callable[[], None]], of: str, after: str) -> None:
    axes, keep = bounded
    if of == "gear":
        motion.move_velocity.asynch(axes[1], ASKED, time_limit="3 s")
    moving = MOTIONS[of](axes)
    axes.system.advance(after)
    keep()
    axes.system.advance("8 s")
    assert moving.done and moving.report.condition in ("arrived", "stopped")
    for joint in axes:
        rows = joint.reference.history[:]
        step = np.abs(np.diff(rows["value"]))
        assert np.diff(rows["number"]).max() > 20, "releases were skipped"
        assert step.max() <= ASKED * 1e-3 * (1 + 1e-6), f"{step.max() / 1e-3} rad/s"


@pytest.mark.parametrize("ms", [5, 19, 40, 70, 200, 450])
@pytest.mark.parametrize("after", ["700 ms", "1.207 s", "1.91 s"])
def test_setpoints_that_stayed_away_are_followed_at_the_speed_asked_for(ms: int, after: str) -> None:
    """The generator stood still alone: the servo has braked meanwhile. One that is late by hardly more than its period is made up for."""
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        axes, keep = machine(cell, on=rtp), late(rtp, ms, priority=70)
        moving = MOTIONS["move_absolute"](axes)
        cell.advance(after)
        keep()
        cell.advance("8 s")
        assert moving.report.condition == "arrived" and axes[0].commanded.value == pytest.approx(0.6)
        rows = axes[0].reference.history[:]
        assert (np.diff(rows["number"]) == 1).all(), "the servo has skipped nothing"
        speed = np.diff(rows["value"]) / 1e-3
        assert np.abs(speed).max() <= ASKED * (1.15 if ms < 30 else 1 + 1e-6), f"{np.abs(speed).max()} rad/s"
        assert np.abs(np.diff(speed)).max() / 1e-3 <= ACCELERATION * (1 + 1e-6), f"{np.abs(np.diff(speed)).max() / 1e-3} rad/s²"


@pytest.mark.parametrize("of", MOTIONS)
def test_a_gap_beyond_the_bound_brings_the_joints_to_rest_and_tells_its_length(of: str) -> None:
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        axes, keep = machine(cell, on=rtp, max_following_error=1.0), late(rtp, 2000)
        if of == "gear":
            motion.move_velocity.asynch(axes[1], ASKED, time_limit="3 s")
        moving = MOTIONS[of](axes)
        cell.advance("700 ms")
        keep()
        cell.advance("5 s")
        words = r"1\.9[0-9]* s were lost at once, more than max_gap \(0\.5 s\) allows"
        with pytest.raises(motion.TimeLost, match=words) as lost:
            moving.wait()
        assert str(lost.value).count("were lost at once") == 1
        assert 1.9 < lost.value.value <= 2.0
        assert tells(cell, words)
        assert axes[0].commanded_velocity.value == 0.0
        assert axes[0].commanded.value < 0.3, "it has not gone on"


def tells(cell: gpac.System, words: str) -> bool:
    """Returns whether an alarm for lost time contains these words."""
    return any(alarm.code == "time_lost" and re.search(words, alarm.text) for alarm in cell.alarms)


@pytest.mark.parametrize("place", ["a part of a chain", "a loop", "two at once"])
def test_an_alarm_tells_the_length_in_a_composition_too(place: str) -> None:
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        axes, keep = machine(cell, on=rtp, max_following_error=1.0), late(rtp, 2000)
        moving = PLACES[place](axes, rtp.timer("slower", period="20 ms", priority=59))
        cell.advance("100 ms")
        keep()
        cell.advance("5 s")
        with pytest.raises(motion.TimeLost, match=r"1\.9[0-9]* s were lost at once"):
            moving.wait()
        assert tells(cell, r"1\.9[0-9]* s were lost at once, more than max_gap \(0\.5 s\) ")


def keeps_its_limits(joint: Joint) -> None:
    """Checks that the reference kept speed and acceleration in every ms outside gaps."""
    rows = joint.reference.history[:]
    step, whole = np.diff(rows["value"]), np.diff(rows["number"]) == 1
    change = np.diff(step)[whole[:-1] & whole[1:]]
    assert np.abs(step[whole]).max() <= SPEED * 1e-3 * (1 + 1e-6)
    assert np.abs(change).max() <= ACCELERATION * 1e-6 * (1 + 1e-6), f"{np.abs(change).max() / 1e-6} rad/s²"


@pytest.mark.parametrize("of", MOTIONS)
def test_a_joint_that_ran_on_in_a_gap_brakes_from_where_it_is_and_stays_enabled(of: str) -> None:
    """The plant continues under its last effort while its servo stands still, 0.21 rad here."""
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        axes, keep = machine(cell, on=rtp, max_following_error=0.05), late(rtp, 700)
        if of == "gear":
            motion.move_velocity.asynch(axes[1], ASKED, time_limit="3 s")
        moving = MOTIONS[of](axes)
        cell.advance("700 ms")
        keep()
        cell.advance("5 s")
        with pytest.raises(motion.TimeLost) as ended:
            moving.wait()
        assert ended.value.value == pytest.approx(0.7, abs=0.03)
        rows = axes[0].sensed.history[:]
        gap = int(np.diff(rows["number"]).argmax())
        assert rows["value"][gap + 1] - rows["value"][gap] > 0.15, "it ran on"
        assert np.diff(rows["value"][gap + 1 :]).min() >= -1e-9, "it does not go back"
        assert rows["value"][-1] - rows["value"][gap + 1] < 0.03, "and comes to rest within its limits"
        assert {joint.state for joint in axes} == {"standstill"}
        assert "following_error" not in cell.alarms
        assert motion.move_absolute(axes, 0.0).condition == "arrived", "the next motion begins where they stand"
        keeps_its_limits(axes[0])


def test_a_joint_at_rest_that_is_where_it_was_has_lost_nothing() -> None:
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        axes, keep = machine(cell, on=rtp, max_following_error=0.05), late(rtp, 700)
        cell.advance("100 ms")
        keep()
        cell.advance("1 s")
        assert [list(joint.braking.value) for joint in axes] == [[0.0] * 4] * 2
        assert motion.move_absolute(axes, 0.1).condition == "arrived"


def a_velocity(name: str) -> Any:
    """Returns a verb that is not a motion of the package, and has no end condition for lost time."""
    return gpac.Verb(
        name,
        blocks={"go": gpac.library.velocity_generator},
        objects={"arm": gpac.each(Joint)},
        instantiation_parameters={"arm.commanded": ["go.start", "go.setpoint"]},
        input_parameters={"velocity": "go.velocity"},
        command_lists={"start": [activate("go", every="20 ms")]},
    )


def chain(axes: Axes, on: Any) -> Any:
    parts = {"a": motion.move_relative, "b": a_velocity("b")}
    verb = gpac.compose("chain", parts, transitions={("a", None): "b"}, rename={"a.speed": "pace"})
    return verb.on(on).asynch(axes, goal=[0.05, 0.05], pace=ASKED, velocity=[ASKED, ASKED])


def loop(axes: Axes, on: Any) -> Any:
    parts = {"there": motion.move_absolute, "back": motion.move_absolute}
    again: dict[tuple[Any, str | None], str] = {("there", None): "back", ("back", None): "there"}
    verb = gpac.compose("round", parts, transitions=again, rename={"back.goal": "home"})
    return verb.on(on).asynch(axes, goal=0.6, home=-0.6, speed=ASKED)


def recovery(axes: Axes, on: Any) -> Any:
    parts = {"short": motion.move_absolute, "instead": a_velocity("instead")}
    verb = gpac.compose("recovering", parts, transitions={("short.give_up", "timed_out"): "instead"})
    return verb.on(on).asynch(axes, goal=1.0, speed=0.1, velocity=[ASKED, ASKED], time_limit="300 ms")


def two_at_once(axes: Axes, on: Any) -> Any:
    own = {f"y.{name}": f"y_{name}" for name in ("goal", "speed", "acceleration", "position", "error", "duration")}
    parts = {"x": motion.move_absolute, "y": motion.move_absolute}
    verb = gpac.together(parts, name="two", rename={"x.arm": "x", "y.arm": "y"} | own, until="all")
    return verb.on(on).asynch(axes[0], axes[1], goal=1.0, speed=ASKED, y_goal=1.0, y_speed=ASKED)


PLACES: dict[str, Callable[[Axes, Any], Any]] = {
    "a verb without an end for it": lambda axes, on: a_velocity("alone").on(on).asynch(axes, velocity=[ASKED, ASKED]),
    "a part of a chain": chain,
    "a loop": loop,
    "a recovery": recovery,
    "two at once": two_at_once,
}


@pytest.mark.parametrize("place", PLACES)
def test_lost_time_ends_whatever_moves_the_joint_wherever_it_is(place: str) -> None:
    """Only the servo stood still: its generators, on another processor, lost nothing."""
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp, other = cell.processor("rtp0"), cell.processor("rtp1")
        axes, keep = machine(cell, on=rtp, max_following_error=0.05), late(rtp, 700)
        moving = PLACES[place](axes, other.timer("slow", period="20 ms", priority=60))
        cell.advance("1 s")
        keep()
        cell.advance("2 s")
        assert moving.done, "nothing else ends it"
        words = r"0\.(69|7)\d* s were lost at once, more than max_gap \(0\.5 s\) of 'axes\.[xy]' allows"
        with pytest.raises(motion.TimeLost, match=words) as ended:
            moving.wait()
        assert (ended.value.condition, ended.value.value) == ("time_lost", pytest.approx(0.7, abs=0.02))
        assert {joint.state for joint in axes} == {"standstill"}
        assert {joint.commanded_velocity.value for joint in axes} == {0.0}
        keeps_its_limits(axes[0])
        assert "time_lost" in cell.alarms
        assert motion.move_absolute(axes, 0.0).condition == "arrived"
        keeps_its_limits(axes[0])


@pytest.mark.parametrize(("before", "after", "is_lost"), [(0.5, 2.0, False), (2.0, 0.5, True)])
def test_a_bound_that_is_changed_counts_at_once(before: float, after: float, is_lost: bool) -> None:
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        axes, keep = machine(cell, on=rtp, max_gap=before), late(rtp, 700)
        moving = motion.move_absolute.asynch(axes, 0.6, speed=ASKED)
        cell.advance("300 ms")
        for joint in axes:
            joint.max_gap = after
        cell.advance("100 ms")
        keep()
        if is_lost:
            with pytest.raises(motion.TimeLost):
                moving.wait()
        else:
            assert moving.wait().condition == "arrived"


def test_the_bound_is_declared_for_each_joint() -> None:
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        axes, keep = machine(cell, on=rtp, max_gap=0.05), late(rtp, 100)
        moving = motion.move_absolute.asynch(axes, 0.6)
        cell.advance("300 ms")
        keep()
        with pytest.raises(motion.TimeLost):
            moving.wait()


def test_a_rate_limiter_and_an_integrator_do_not_leap() -> None:
    with gpac.System("late", clock="virtual", seed=1) as cell:
        rtp = cell.processor("rtp0")
        fast, keep = rtp.timer("fast", period="1 ms", priority=80), late(rtp, 500)
        lib = gpac.library
        ramp = gpac.Verb(
            "ramp",
            blocks={"limit": lib.rate_limiter, "sum": lib.integrator},
            instantiation_parameters={"u": ["limit.u", "sum.u"], "y": "limit.y", "total": "sum.y"},
            modes={"limit.u": "asynchronous", "sum.u": "asynchronous"},
            command_lists={"start": [activate("limit", every="1 ms"), activate("sum", every="1 ms")]},
        )
        u = cell.svv("in", float)
        y, total = cell.svv("out", float, history=5000), cell.svv("total", float, history=5000)
        ramp.on(fast).asynch(u, y, total)
        cell.advance("10 ms")
        u.value = 100.0
        cell.advance("100 ms")
        keep()
        cell.advance("1 s")
        assert np.abs(np.diff(y.history[:]["value"])).max() <= 1e-3 * (1 + 1e-9)
        assert np.abs(np.diff(total.history[:]["value"])).max() <= 0.1 * (1 + 1e-9)
