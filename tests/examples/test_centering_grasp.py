# SPDX-License-Identifier: Apache-2.0
"""Centering grasp: the block is not pushed away, wherever it is between the fingers, and the verb returns its width."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import grasping
import opengpac as gpac
from centering_grasp import PUSHED_MAX, Workcell, centering_grasp

OFFSETS_MM = [-20, -15, -10, -5, 0, 5, 10, 15, 20]


@pytest.fixture
def work() -> Iterator[Workcell]:
    """Yields the workcell of the example, enabled."""
    with gpac.System("grasp", clock="virtual") as cell:
        made = Workcell(cell)
        with made.arm.enabled(), made.hand.enabled(), made.watch():
            cell.advance("50 ms")
            yield made


def beside(work: Workcell, offset: float) -> None:
    """Moves the hand to the side."""
    if offset:
        grasping.shift(work.blocks)(work.arm, distance=offset)


def pushed(work: Workcell, before: Any) -> float:
    """Returns the displacement of the block on the bench, m."""
    return float(np.hypot(*(np.array(work.place.value) - before)[:2]))


def test_the_program_ends_as_it_should_with_its_trace(programs: Any) -> None:
    done = programs.run("centering_grasp", "--offset", "-12")
    assert done.code == 0, done.printed
    assert "All verbs ended as they should" in done.printed
    programs.compare("centering_grasp", done.trace, within=1e-4)


@pytest.mark.parametrize("offset_mm", OFFSETS_MM)
def test_a_block_off_centre_is_grasped_and_not_pushed_away(work: Workcell, offset_mm: int) -> None:
    offset = offset_mm * 1e-3
    beside(work, offset)
    before = np.array(work.place.value)
    report = centering_grasp(work.blocks)(work.hand, work.arm, time_limit="20 s")
    assert report.condition == "gripped"
    assert abs(report.width - 0.040) < 0.0005
    left, right = work.hand.values("sensed")
    assert abs(left - right) < 0.001, "the arm has gone to where the block is"
    assert pushed(work, before) < PUSHED_MAX
    work.cell.advance("0.5 s")
    assert pushed(work, before) < PUSHED_MAX, "nor afterwards"
    grasping.shift(work.blocks)(work.arm, distance=0.03, direction=(0.0, 0.0, -1.0))
    assert work.place.value[2] - before[2] > 0.028, "it is in the hand"


@pytest.mark.parametrize("offset_mm", [-10, 10])
def test_stiff_fingers_without_centering_push_the_block(work: Workcell, offset_mm: int) -> None:
    beside(work, offset_mm * 1e-3)
    before = np.array(work.place.value)
    for finger in work.hand:
        finger.stiffness, finger.damping = 3000.0, 30.0
    report = grasping.squeeze(work.blocks)(work.hand, grip=40.0, time_limit="20 s")
    assert report.condition == "gripped" and pushed(work, before) > 4 * PUSHED_MAX


def test_the_simple_verbs_are_of_use_alone(work: Workcell) -> None:
    blocks = work.blocks
    beside(work, 0.01)
    touched = grasping.approach(blocks)(work.hand)
    assert touched.condition == "contact" and 0.1 < touched.difference < 1.0, "the left finger feels it first"
    centred = grasping.center(blocks)(work.hand, work.arm, time_limit="10 s")
    assert centred.condition == "centred" and abs(centred.yielded + 0.01) < 0.001
    assert grasping.squeeze(blocks)(work.hand, grip=20.0, firm=18.0).condition == "gripped"
    assert min(work.hand.values("force")) > 18.0
    assert grasping.release(blocks)(work.hand).condition == "open"
    work.cell.advance("0.2 s")
    assert max(work.hand.values("force")) == 0.0


def test_r119_centering_grasp_is_composed_of_simple_verbs(work: Workcell) -> None:
    verb = centering_grasp(work.blocks)
    assert [*verb.parts] == ["approach", "center", "squeeze"] and not verb.simple
    assert all(part.simple for part in verb.parts.values())
    assert verb.transitions == {("approach.start", "contact"): "center.start", ("center.start", "centred"): "squeeze.start"}


def test_where_nothing_is_it_says_so(work: Workcell) -> None:
    grasping.shift(work.blocks)(work.arm, distance=0.1, direction=(0.0, 0.0, -1.0))
    with pytest.raises(grasping.NothingGrasped) as caught:
        centering_grasp(work.blocks)(work.hand, work.arm, time_limit="20 s")
    assert (caught.value.condition, caught.value.command_list) == ("empty", "approach.start")


def test_the_tool_moves_on_a_line_and_does_not_turn(work: Workcell) -> None:
    """Compares the block's kinematics with those of the physics engine, at every step of 40 mm along a slanting line."""
    import mujoco

    from opengpac import robots

    model = mujoco.MjModel.from_xml_path(str(Path(robots.__file__).parent / "ur5e.xml"))
    data = mujoco.MjData(model)

    def tool(q: Any) -> tuple[np.ndarray, np.ndarray]:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        return data.site("tool").xpos.copy(), data.site("tool").xmat.reshape(3, 3).copy()

    start, along = gpac.deg([10, -80, 70, -95, -85, 20]), np.linspace(0.0, 0.04, 41)
    run = work.blocks.line.tool_line.run(start=[list(start)] * 41, along=list(along), direction=[0.6, 0.0, -0.8])
    assert run.fault is None
    home, upright = tool(start)
    for distance, q in zip(along, run.setpoint, strict=True):
        place, turn = tool(q)
        assert np.abs(upright.T @ (place - home) - distance * np.array([0.6, 0.0, -0.8])).max() < 1e-5
        assert np.abs(turn - upright).max() < 1e-5
