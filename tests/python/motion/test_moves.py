# SPDX-License-Identifier: Apache-2.0
"""Moves to positions arrive exactly and together, within the limits, even from a moving start; goals outside are refused."""

from __future__ import annotations

import numpy as np
import pytest

import opengpac as gpac
from axes import RANGE, Watch
from opengpac import activate, library, motion, on
from opengpac.robots import Joint


def test_an_absolute_move_goes_along_a_line_and_arrives_exactly(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    report = watch.wait(motion.move_absolute.asynch(axes, [1.0, -0.5], speed="50 %"))
    assert report.condition == "arrived" and report.error <= 0.002
    assert axes.values("commanded") == [1.0, -0.5] == axes.values("reference")
    # 1/0.5 + 0.5/4 + 4/80 s, the closed form of a move that reaches its speed and acceleration.
    assert report.duration == pytest.approx(2.175)
    speed = watch.smooth()
    assert np.abs(speed[:, 0]).max() == pytest.approx(0.5)
    path = watch.path
    assert np.abs(path[:, 0] + 2 * path[:, 1]).max() < 1e-9, "along a straight line"


def test_a_relative_move_counts_from_the_commanded_position(axes: gpac.Group[Joint]) -> None:
    motion.move_absolute(axes, [0.5, 0.25])
    motion.move_relative(axes, [0.1, -0.1])
    motion.move_relative(axes[0], "10 deg")
    assert axes.values("commanded") == pytest.approx([0.6 + np.deg2rad(10), 0.15], abs=1e-12)


def test_one_number_is_for_all_joints_and_a_dictionary_over_the_present(axes: gpac.Group[Joint]) -> None:
    motion.move_absolute(axes, 0.25, speed=0.9)
    motion.move_absolute(axes, {"y": 0.5}, speed=[0.1, "100 %"])
    assert axes.values("commanded") == pytest.approx([0.25, 0.5], abs=2e-3)


def test_a_halted_move_slows_down_first_and_its_end_is_normal(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    moving = motion.move_absolute.asynch(axes, [1.5, -0.3], speed="100 %", acceleration="50 %")
    watch.run(700)
    assert axes[0].commanded_velocity.value > 0.5
    moving.halt()
    watch.run(500)
    report = moving.wait()
    assert report.condition in ("stopped", "halted")
    watch.smooth()
    assert axes.values("commanded_velocity") == [0.0, 0.0] and 0.2 < axes[0].reference.value < 1.5


def test_a_move_whose_time_is_up_slows_down_and_raises(axes: gpac.Group[Joint]) -> None:
    watch = Watch(axes)
    moving = motion.move_absolute.asynch(axes, [1.5, 0.0], speed="100 %", time_limit="0.8 s")
    with pytest.raises(motion.MoveTimeout):
        watch.wait(moving)
    watch.smooth()
    assert axes[0].commanded_velocity.value == 0.0


@pytest.mark.parametrize("seed", range(6))
def test_a_motion_that_takes_over_goes_on_smoothly(axes: gpac.Group[Joint], seed: int) -> None:
    """A velocity, a move and a stop take over from each other at random times: neither position nor speed ever jumps."""
    random = np.random.default_rng(seed)
    labels = ("first", "second")
    generators = [f"{label}.{port}" for label in (*labels, "move") for port in ("start", "setpoint")]
    take_over = gpac.Verb(
        "take_over",
        blocks={
            **dict.fromkeys(labels, library.velocity_generator),
            "move": library.motion_generator,
            "timer": library.time_limit,
            "later": library.time_limit,
        },
        objects={"arm": gpac.each(Joint)},
        instantiation_parameters={
            "arm.commanded": generators,
            "arm.commanded_velocity": [f"{label}.start_velocity" for label in (*labels, "move")],
        },
        input_parameters={
            "u": gpac.input("first.velocity", within=(-1, 1)),
            "v": gpac.input("second.velocity", within=(-1, 1)),
            "goal": "move.goal",
            "time": "timer.limit",
            "more": "later.limit",
            "arm.max_speed": "move.speed",
            **{f"arm.max_{name}": [f"{label}.{name}" for label in (*labels, "move")] for name in ("acceleration", "jerk")},
        },
        command_lists={
            "one": [activate("timer", every="20 ms"), activate("first", every="20 ms")],
            "two": [activate("later", every="20 ms"), activate("second", every="20 ms")],
            "three": [activate("move", every="20 ms")],
        },
        initial="one",
        conditions={
            "next": on("timer.expired", during="one"),
            "last": on("later.expired", during="two"),
            "there": on("move.finished", returns=[], during="three"),
        },
        transitions={("one", "next"): "two", ("two", "last"): "three"},
    )
    watch = Watch(axes)
    for _ in range(3):
        goal = random.uniform(-1.5, 1.5, 2)
        u, v = random.uniform(-0.95, 0.95, (2, 2))
        time, more = random.uniform(0.02, 0.6, 2)
        watch.wait(take_over.asynch(axes, u=u, v=v, goal=goal, time=float(time), more=float(more)))
        assert axes.values("reference") == pytest.approx(list(goal), abs=1e-12)
    watch.smooth()
    assert axes.values("limited") == [0, 0]


def test_a_goal_outside_the_range_is_refused_before_anything_moves(axes: gpac.Group[Joint]) -> None:
    said = r"'goal' for 'axes.y' is 90 rad, but its range is -2 to 2 rad.*did you mean '90 deg'\?.*test_moves.py"
    with pytest.raises(gpac.OutOfRange, match=said):
        motion.move_absolute(axes, [0.5, 90])
    with pytest.raises(gpac.OutOfRange, match=r"'goal' for 'axes.x' is 500 rad, .*give a value within the range"):
        motion.move_absolute(axes[0], 500)
    with pytest.raises(gpac.OutOfRange) as all_at_once:
        motion.move_absolute(axes, [3.0, 1e9])
    assert isinstance(all_at_once.value, gpac.InstallationErrors) and len(all_at_once.value.errors) == 2
    motion.move_absolute(axes, [1.0, 0.0], speed="100 %")
    with pytest.raises(gpac.OutOfRange, match=r"is 1.5 rad from 1, that is 2.5 rad, but its range"):
        motion.move_relative(axes, [1.5, 0.0])
    with pytest.raises(gpac.OutOfRange, match=r"'speed' for 'axes.x' is 30 rad/s, .*did you mean '30 deg/s'\?"):
        motion.move_absolute(axes, 0.0, speed=[30, 0.5])
    with pytest.raises(gpac.UnitMismatch):
        motion.move_absolute(axes, "3 mm")
    assert axes.values("commanded") == [1.0, 0.0] and axes[0].state == "standstill"
    assert (axes[0].position_min, axes[0].position_max) == RANGE


def test_the_servo_keeps_to_the_range_whatever_is_stored(axes: gpac.Group[Joint]) -> None:
    with pytest.raises(gpac.OutOfRange, match="cannot be 5 rad: its range is -2 to 2 rad"):
        axes[0].commanded = 5.0
    stored = gpac.Verb(
        "stored",
        blocks={"five": library.signal_generator(shape=0, offset=5.0)},
        instantiation_parameters={"commanded": "five.y"},
        command_lists={"start": [activate("five", every="20 ms")]},
    )
    stored.on(axes.system.sources["rtp0.slow"]).asynch(axes[0].commanded)
    watch = Watch(axes).run(4000)
    assert axes[0].reference.value == 2.0 and axes[0].limited.value > 1000
    assert np.abs(np.diff(watch.path, axis=0)).max() <= 1.0e-3 * (1 + 1e-9), "no faster than max_speed"


def test_a_move_of_the_ur5e_keeps_to_its_limits() -> None:
    arm = gpac.robots.load("ur5e", clock="virtual").enable()
    goal = gpac.deg([20, -80, 95, -10, 15, 5])
    report = motion.move_absolute(arm, goal, speed="40 %", time_limit="20 s")
    assert report.condition == "arrived" and np.abs(report.position - goal).max() <= 0.002
    assert np.abs(arm[0].velocity.value) < 0.01
    arm.system.close()


def test_a_sliding_joint_counts_in_metres() -> None:
    cell = gpac.System("slide", clock="virtual")
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="1 ms", priority=80)
    rtp.timer("slow", period="20 ms", priority=60)
    plant = rtp.physical_device("plant", gpac.drivers.loopback("lift"), exchange=fast)
    lift = Joint(
        "lift", drive=plant["lift"], on=fast, units={"N.m": "N", "rad": "m"}, position_max="1200 mm", max_speed="0.5 m/s", kp=50.0, kd=0.0
    )
    assert (lift.sensed.unit, lift.commanded_velocity.unit, lift.position_max) == ("m", "m/s", 1.2)
    lift.enable()
    motion.move_absolute(lift, "250 mm")
    assert lift.commanded.value == pytest.approx(0.25)
    with pytest.raises(gpac.UnitMismatch):
        motion.move_absolute(lift, "10 deg")
    with pytest.raises(gpac.OutOfRange, match=r"'goal' for 'lift' is 2 m, but its range is -1000000 to 1.2 m"):
        motion.move_absolute(lift, 2.0)
    with pytest.raises(gpac.UnitMismatch):
        lift.max_speed = "1 rad/s"


def test_a_requirement_names_a_member_and_a_refusal() -> None:
    def needing(requires: object, **inputs: object) -> gpac.Verb[..., gpac.Report]:
        return gpac.Verb(
            "needing",
            blocks={"f": library.gain},
            objects={"arm": Joint},
            instantiation_parameters={"arm.sensed": "f.u"},
            input_parameters={"k": gpac.input("f.k", **inputs)},  # type: ignore[arg-type]
            command_lists={"start": [activate("f", every="20 ms")]},
            modes={"f.u": "asynchronous"},
            requires=requires,  # type: ignore[arg-type]
        )

    with pytest.raises(gpac.UnknownName, match=r"a requirement names 'arm.home_d'.*did you mean 'homed'\?"):
        needing({"arm.home_d": gpac.NotHomed})
    with pytest.raises(gpac.UnknownName, match=r"the range of the input parameter 'k' names 'arm.most'"):
        needing({}, within=(0, "arm.most"))
    with pytest.raises(
        gpac.DefinitionError, match=r"a requirement raises must be an exception class of OpenGPAC, not .*ValueError.*pass one of "
    ):
        needing({"arm.homed": gpac.required(ValueError)})  # type: ignore[arg-type]
    with pytest.raises(gpac.DefinitionError, match=r"requirement 'arm.homed' must be an exception class or gpac.required\(...\), not 5"):
        needing({"arm.homed": 5})


def test_a_composition_keeps_ranges_and_requirements(axes: gpac.Group[Joint]) -> None:
    there_and_back = gpac.compose(
        "there_and_back",
        parts={"there": motion.move_absolute, "back": motion.move_relative},
        transitions={("there", "arrived"): "back"},
        rename={"there.goal": "first", "back.goal": "then"},
    )
    there_and_back(axes, first=0.5, then="-100 mrad", speed="60 %")
    assert axes.values("commanded") == pytest.approx([0.4, 0.4])
    with pytest.raises(gpac.OutOfRange, match=r"'first' for 'axes.x' is 90 rad, .*did you mean '90 deg'\?"):
        there_and_back(axes, first=90, then=0.0)
