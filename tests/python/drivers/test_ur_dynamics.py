# SPDX-License-Identifier: Apache-2.0
"""The emulated controller with an arm simulated by MuJoCo: it follows its commands, has weight, and senses contact."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac.drivers.fake.dynamics import SimulatedArm, model_of

HOME = gpac.deg([0, -90, 90, -90, -90, 0])
SCENES = Path(__file__).parents[3] / "examples" / "scenes"
MAT, BENCH = SCENES / "mat.xml", SCENES / "bench.xml"


def arm(scene: Path | None = None) -> SimulatedArm:
    """Returns a UR5e at its home position."""
    return SimulatedArm(list(HOME), 0.05, model_of("ur5e"), None, scene)


def test_it_follows_a_goal_that_moves_and_stands_where_it_is_left() -> None:
    moved = arm()
    for cycle in range(1, 251):
        moved.command([HOME[0] + 0.002 * cycle, *HOME[1:]])
        moved.advance()
    assert moved.q == pytest.approx([HOME[0] + 0.5, *HOME[1:]], abs=5e-3)
    assert moved.velocity[0] == pytest.approx(1.0, abs=0.05)
    moved.rest()
    stood = moved.q[0]
    for _ in range(250):
        moved.advance()
    assert moved.q == pytest.approx([stood, *HOME[1:]], abs=5e-3), "it holds itself against its weight"
    assert max(map(abs, moved.velocity)) < 1e-3


def test_a_goal_that_its_motors_cannot_follow_leaves_it_behind() -> None:
    heavy = arm()
    heavy.leap_max = 10.0
    heavy.command([HOME[0] + 2.0, *HOME[1:]])
    heavy.advance()
    assert abs(heavy.q[0] - HOME[0]) < 0.01


def test_it_feels_what_it_touches_and_not_its_own_weight() -> None:
    assert max(map(abs, arm().touch())) < 0.01
    down = arm(MAT)
    for cycle in range(400):
        # Shoulder and elbow lower the tool onto the mat.
        down.command([HOME[0], HOME[1] + 0.0003 * cycle, *HOME[2:]])
        down.advance()
    _, _, up = down.touch()
    assert up > 10.0, "the mat presses upwards, in the frame of the base"


@pytest.mark.parametrize("given", [{"scene": MAT}, {"tool": "two_finger"}])
def test_a_scene_and_a_tool_need_a_model(given: dict[str, Any]) -> None:
    with pytest.raises(gpac.CallError, match="requires a model; pass both"):
        gpac.drivers.fake.ur(**given)


def test_its_gripper_is_a_device_of_its_own_that_closes_with_no_more_force_than_it_may() -> None:
    with (
        gpac.drivers.fake.ur(HOME, model="ur5e", tool="two_finger", scene=BENCH) as robot,
        gpac.System("hand", clock="virtual") as cell,
    ):
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        arm = gpac.robots.load("ur5e", on=fast, driver=robot.driver(), tool="two_finger").enable()
        device = fast.processor.physical_device("hand", robot.gripper.driver(), exchange=fast)
        hand = gpac.robots.gripper(device, name="hand").enable()
        cell.advance("0.2 s")
        assert hand.values("commanded") == pytest.approx([0.048, 0.048], abs=1e-4), "they stay where they are"
        before = robot.sensor("object")
        for finger in hand:
            finger.force_max, finger.commanded = 8.0, -0.1
        cell.advance("1 s")
        assert hand.values("force") == pytest.approx([8.0, 8.0], abs=0.5)
        assert sum(hand.values("sensed")) == pytest.approx(0.04, abs=1e-3), "the block is between them"
        assert robot.sensor("object") == pytest.approx(before, abs=2e-3)
        assert arm.elbow.state == "standstill"
        hand.disable()
        cell.advance("0.2 s")
        assert robot.sensor("left_finger") == pytest.approx([0.0], abs=0.1), "without a command it has no force"


def test_what_its_model_does_not_have_is_refused() -> None:
    with gpac.drivers.fake.ur(HOME, model="ur5e") as robot:
        with pytest.raises(gpac.CallError, match="has no gripper; add one"):
            _ = robot.gripper
        with pytest.raises(gpac.CallError, match="no sensor 'tool_farce'; did you mean 'tool_force'"):
            robot.sensor("tool_farce")
    with gpac.drivers.fake.ur(HOME) as robot, pytest.raises(gpac.CallError, match="has no model, and therefore no sensor"):
        robot.sensor("object")


def test_its_controller_tells_the_force() -> None:
    with gpac.drivers.fake.ur(HOME, model="ur5e") as robot:
        made = gpac.robots.load("ur5e", driver=robot.driver(), clock="virtual").enable()
        cell = made.system
        assert gpac.robots.move(made, goal=HOME + 0.2, speed=0.8).position == pytest.approx(HOME + 0.2, abs=3e-3)
        robot.press([0.0, 0.0, -20.0])
        cell.advance("20 ms")
        assert cell.read(cell.physical_devices["ur5e"]["tool.force"])[0][2] == pytest.approx(-20.0, abs=3.0)
        assert robot.step_max < 0.05
        cell.close()
