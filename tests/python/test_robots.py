# SPDX-License-Identifier: Apache-2.0
"""Arms with a tool and a scene, the sensors of their models, and fingers."""

from __future__ import annotations

from pathlib import Path

import pytest

import opengpac as gpac
from opengpac import robots

TOOL = """<mujoco><compiler angle="radian"/><worldbody><body name="probe"><joint name="probe" type="slide" axis="0 0 1"/>
<geom name="tip" size="0.01" mass="0.1"/></body></worldbody><actuator><motor joint="probe"/></actuator>
<sensor><jointpos name="probe" joint="probe"/><framepos name="tip" objtype="geom" objname="tip"/></sensor>
<keyframe><key name="home" qpos="0.02"/></keyframe></mujoco>"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Returns a folder with a tool of one joint."""
    (tmp_path / "tool.xml").write_text(TOOL)
    return tmp_path


def test_a_tool_is_screwed_to_the_flange_and_the_group_is_the_arm(folder: Path) -> None:
    arm = robots.load("ur5e", clock="virtual", tool=folder / "tool.xml")
    machine = arm.system.physical_devices["ur5e"]
    assert len([*arm]) == 6 and machine.parts == [*(joint.short_name for joint in arm), "probe"]
    assert machine["probe"].about["home"] == 0.02, "the keyframes stand side by side"
    position, tip, force = (machine[f"sensor.{name}"] for name in ("probe", "tip", "tool_force"))
    assert (position.type, position.unit) == ("double", "m")
    assert (tip.type, tip.unit) == ("double[3]", "m") and not tip.write
    assert force.unit == "N"
    arm.system.close()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("<keyframe>", "<keyframe><!--"), "is not XML"),
        (('name="home"', 'name="away"'), "is missing in some files of the model"),
        (('type="slide"', 'range="-1 1"'), "has angles in radians, but the arm in degrees"),
    ],
)
def test_a_tool_that_does_not_fit_says_why(folder: Path, change: tuple[str, str], message: str) -> None:
    (folder / "tool.xml").write_text(TOOL.replace(*change))
    with pytest.raises(gpac.DeviceFailed, match=message):
        robots.load("ur5e", clock="virtual", tool=folder / "tool.xml")


def test_a_tool_needs_a_flange(folder: Path) -> None:
    with pytest.raises(gpac.DeviceFailed, match="has no site for a tool"):
        robots.load("two_joint", clock="virtual", tool=folder / "tool.xml")
    with pytest.raises(gpac.DeviceFailed, match="cannot read"):
        robots.load("ur5e", clock="virtual", tool=folder / "no_such_tool.xml")


def test_fingers_hold_and_exert_no_more_than_their_force() -> None:
    arm = robots.load("ur5e", clock="virtual", tool="two_finger")
    cell = arm.system
    hand = robots.gripper(cell.physical_devices["ur5e"])
    assert [finger.name for finger in hand] == ["ur5e.hand.left_finger", "ur5e.hand.right_finger"]
    with hand.enabled():
        assert all(abs(position - 0.048) < 1e-5 for position in hand.values("commanded"))
        left, right = hand
        left.commanded = 0.02
        cell.advance("1 s")
        assert abs(left.sensed.value - 0.02) < 1e-4 and abs(right.sensed.value - 0.048) < 1e-4
        left.commanded = -1.0
        cell.advance("1 s")
        assert abs(left.sensed.value) < 1e-3, "half a newton does not go beyond the stop"
    cell.close()
