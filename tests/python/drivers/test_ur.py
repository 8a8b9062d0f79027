# SPDX-License-Identifier: Apache-2.0
"""A Universal Robots arm with its driver, against an emulated controller that runs the driver's own program.

In lockstep each packet advances the controller by one cycle, so that the results do not depend on the machine's speed.
"""

from __future__ import annotations

import importlib
import itertools
import os
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import opengpac as gpac

fake = gpac.drivers.fake

CYCLE = 2e-3
START = gpac.deg([0, -90, 90, -90, -90, 0])


@pytest.fixture
def robot() -> Iterator[gpac.drivers.fake.ur]:
    with fake.ur(START) as robot:
        yield robot


@pytest.fixture
def arm(robot: gpac.drivers.fake.ur) -> Iterator[gpac.robots.Arm]:
    arm = gpac.robots.load("ur5e", driver=robot.driver(), clock="virtual")
    yield arm.enable()
    arm.system.close()


def within_its_speed(robot: gpac.drivers.fake.ur) -> bool:
    """Returns whether each goal was within the joints' maximum speed of the previous one."""
    return robot.step_max <= np.pi * CYCLE * (1 + 1e-6)


def lost(arm: gpac.robots.Arm) -> str:
    """Advances time until the arm is lost, and returns the reason."""
    device = arm.system.physical_devices["ur5e"]
    arm.system.advance("0.1 s")
    about = str(arm.system.statistics["physical_devices"][device.name]["lost"])
    assert about != "None", "the arm is still there"
    return about


def recovered(arm: gpac.robots.Arm) -> None:
    """Resets the system and enables the arm, which does not move."""
    arm.system.reset()
    arm.enable()
    before = arm.values("sensed")
    arm.system.advance("0.1 s")
    assert arm.values("sensed") == pytest.approx(before, abs=1e-9), "it moved when it was enabled"


def test_the_three_lines_of_the_readme_move_it(robot: gpac.drivers.fake.ur) -> None:
    arm = gpac.robots.load("ur5e", driver=robot.driver(), clock="virtual").enable()
    moved = gpac.robots.move(arm, goal=gpac.deg([10, -80, 80, -90, -90, 10]), speed=0.5)
    assert moved.position == pytest.approx(gpac.deg([10, -80, 80, -90, -90, 10]), abs=2e-3)
    assert robot.position == pytest.approx(gpac.deg([10, -80, 80, -90, -90, 10]), abs=2e-3)
    assert within_its_speed(robot) and robot.program == "opengpac"
    arm.system.close()


def test_every_kind_of_motion_is_as_with_the_simulated_arm(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur) -> None:
    gpac.motion.move_absolute(arm, gpac.deg([20, -80, 80, -90, -90, 0]))
    gpac.motion.move_relative(arm, gpac.deg([-10, 0, 0, 0, 0, 5]))
    here = arm.pose()
    there = gpac.Pose.of([*np.add(list(here)[:3], [0.05, 0.0, 0.05]), *list(here)[3:]])
    gpac.motion.move_linear(arm, there)
    assert list(arm.pose()) == pytest.approx(list(there), abs=2e-3)
    vi = gpac.motion.move_velocity.asynch(arm.wrist_3, "20 %")
    arm.system.advance("0.3 s")
    vi.halt()
    vi.delete()
    gpac.motion.stop(arm)
    assert within_its_speed(robot) and robot.log == []


def test_a_pause_on_the_way_makes_no_leap(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur) -> None:
    goal = gpac.deg([60, -60, 60, -60, -60, 60])
    vi = gpac.motion.move_absolute.asynch(arm, goal, speed="30 %")
    for _ in range(3):
        arm.system.advance("0.2 s")
        vi.suspend()
        arm.system.advance("0.2 s")
        vi.resume()
    vi.wait()
    assert robot.position == pytest.approx(goal, abs=2e-3) and within_its_speed(robot)


def test_a_protective_stop_is_named_and_released_by_a_service(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur) -> None:
    vi = gpac.motion.move_absolute.asynch(arm, gpac.deg([60, -60, 60, -60, -60, 60]))
    arm.system.advance("0.4 s")
    robot.protective_stop()
    with pytest.raises(gpac.Terminated) as ended:
        vi.wait()
    assert ended.value.condition == "device_lost" and "protective stop" in lost(arm)
    assert "protective stop: find its cause" in ended.value.message, "what the motion raises says why"
    with pytest.raises(gpac.Error, match="protective stop"):
        arm.system.physical_devices["ur5e"].reopen()
    robot.release()
    recovered(arm)
    gpac.motion.move_absolute(arm, START)
    assert within_its_speed(robot)


@pytest.mark.parametrize(
    ("happens", "named"),
    [
        ("stop_program", "stopped on the pendant"),
        ("pause_program", "paused on the pendant"),
        ("emergency_stop", "emergency stop at the robot"),
    ],
)
def test_what_happens_at_the_pendant_is_named(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur, happens: str, named: str) -> None:
    getattr(robot, happens)()
    assert named in lost(arm)
    robot.release()
    robot.power_on()
    recovered(arm)
    gpac.motion.move_relative(arm, 0.1)
    assert within_its_speed(robot)


def test_a_restart_of_the_controller_is_survived(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur) -> None:
    gpac.motion.move_absolute.asynch(arm, gpac.deg([60, -60, 60, -60, -60, 60]))
    arm.system.advance("0.3 s")
    robot.off()
    assert "restarted" in lost(arm)
    robot.on()
    recovered(arm)
    gpac.motion.move_absolute(arm, START)
    assert within_its_speed(robot)


def test_a_reset_waits_for_a_controller_that_boots_and_its_silence_is_none_of_the_arm(
    arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur
) -> None:
    robot.off()
    assert "restarted" in lost(arm)
    booting = threading.Thread(target=robot.on)
    booting.start()
    arm.system.reset()
    booting.join()
    assert str(arm.system.statistics["physical_devices"]["ur5e"]["lost"]) == "None"
    arm.enable()
    arm.system.advance("0.5 s")
    gpac.motion.move_absolute(arm, START)
    assert within_its_speed(robot)


def test_a_reset_says_what_is_lost_still_where_the_controller_stays_off(robot: gpac.drivers.fake.ur) -> None:
    cell = gpac.System("cell", clock="virtual")
    fast = cell.processor("rtp0").timer("fast", period="2 ms", priority=80)
    driver = gpac.drivers.ur(robot.host, wait="0 s")
    device = cell.processors["rtp0"].physical_device("ur5e", driver, exchange=fast)
    robot.off()
    cell.advance("0.1 s")
    left = cell.reset()
    assert [*left] == [device.name] and "waited for" not in str(left), left


def test_an_arm_that_cannot_follow_is_refused_with_the_cause(robot: gpac.drivers.fake.ur) -> None:
    cell = gpac.System("cell", clock="virtual")
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)

    def refused() -> str:
        with pytest.raises(gpac.DeviceFailed) as why:
            gpac.robots.load("ur5e", on=fast, driver=robot.driver(wait=0))
        return str(why.value)

    robot.is_remote = False
    assert "remote control is not enabled" in refused()
    robot.is_remote = True
    robot.protective_stop()
    assert "protective stop" in refused()
    robot.release()
    robot.off()
    assert "no controller answers" in refused()
    robot.on(powered=False)
    assert "powered off" in refused()
    arm = gpac.robots.load("ur5e", on=fast, driver=robot.driver(power_on=True)).enable()
    gpac.motion.move_relative(arm, 0.05)
    cell.close()


def test_without_commands_its_own_program_stops_it(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur) -> None:
    gpac.motion.move_velocity.asynch(arm.wrist_3, "20 %")
    arm.system.advance("0.3 s")
    # Cycles without a packet, as if this host were frozen.
    robot.do(lambda: [robot.cycle() for _ in range(40)])
    assert robot.program is None
    before = robot.position
    robot.do(lambda: [robot.cycle() for _ in range(40)])
    assert robot.position == before
    assert "no setpoint arrived" in lost(arm)


def test_force_and_digital_signals_are_channels(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur) -> None:
    device = arm.system.physical_devices["ur5e"]
    part = gpac.cell.DigitalInput("part", device["io.in2"], on=device.source).enable()
    lamp = gpac.cell.DigitalOutput("lamp", device["io.out3"], on=device.source).enable()
    robot.set_input(2, True)
    robot.press([0.0, 0.0, -12.5])
    gpac.cell.set_output(lamp, True)
    arm.system.advance("0.1 s")
    assert part.value.value and robot.output(3) and not robot.output(2)


EVENTS = ("move", "jog", "pause", "protective_stop", "stop_program", "restart", "another_enabling")


def test_the_guarded_move_of_the_examples_stops_at_a_force(
    arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parents[3] / "examples")
    example = importlib.import_module("coordinated_motion")
    device = arm.system.physical_devices["ur5e"]
    slow = next(source for source in arm.system.sources.values() if source.period == pytest.approx(20e-3))
    guarded = example.guarded_move.on({"sensor": device.source, "guard": device.source, "*": slow})
    goal = START + gpac.deg([60, 10, 10, 0, 0, 0])
    vi = guarded.asynch(arm, device["tool.force"], goal, speed=0.5, time_limit="10 s")
    arm.system.advance("0.4 s")
    robot.press([0.0, 60.0, 0.0])
    with pytest.raises(example.UnexpectedForce) as met:
        vi.wait()
    assert met.value.value == pytest.approx(60.0)
    robot.press([0.0, 0.0, 0.0])
    arm.system.advance("10 ms")
    guarded(arm, device["tool.force"], goal, speed=0.5, time_limit="10 s")
    assert robot.position == pytest.approx(goal, abs=2e-3) and within_its_speed(robot)


# Number of seeds, with ten events each; `make faults` runs a hundred.
SEEDS = int(os.environ.get("OPENGPAC_UR_SEEDS", "4"))


@pytest.mark.parametrize("seed", range(SEEDS))
def test_no_order_of_events_makes_a_leap(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur, seed: int) -> None:
    random = np.random.default_rng(seed)
    for event in random.choice(EVENTS, 10):
        happen(arm, robot, str(event), random)
        assert within_its_speed(robot), event
    assert not [line for line in robot.log if "rad from the previous one" in line]


def happen(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur, event: str, random: np.random.Generator) -> None:
    """Injects an event at a random instant of a motion, followed by a person's response."""
    if event == "another_enabling":
        arm.disable()
        arm.enable()
    goal = START + random.uniform(-0.4, 0.4, 6)
    vi = gpac.motion.move_absolute.asynch(arm, goal, speed="80 %")
    arm.system.advance(f"{random.integers(1, 400)} ms")
    if event == "pause":
        vi.suspend()
        arm.system.advance(f"{random.integers(1, 100)} ms")
        vi.resume()
    if event in ("protective_stop", "stop_program", "restart"):
        for act in ("off", "on") if event == "restart" else (event,):
            getattr(robot, act)()
        arm.system.advance("0.1 s")
        robot.release()
        with pytest.raises(gpac.Terminated):
            vi.wait()
        recovered(arm)
        return
    if event == "jog":
        vi.halt()
        vi.delete()
        vi = gpac.motion.move_velocity.asynch(arm, random.uniform(-0.5, 0.5, 6), time_limit="0.2 s")
    vi.wait()


def test_the_program_on_the_controller_ignores_goals_of_another_session(arm: gpac.robots.Arm, robot: gpac.drivers.fake.ur) -> None:
    before = robot.position
    stale = itertools.count(10)

    def forge() -> None:
        robot.take({"input_int_register_24": next(stale), "input_int_register_25": 7, "input_double_register_24": 2.0})

    robot.do(forge)
    assert robot.position == pytest.approx(before, abs=1e-12)
